"""How far the run is, and who is told."""

from __future__ import annotations

import inspect
import json
import re
import urllib.error
import urllib.request

import pytest

from palaestra_sim.protocol.status import TrainerStatus
from palaestra_trainer.errors import ConfigurationError, SimulatorDead, SimulatorHung
from palaestra_trainer.evaluation import Episode, Evaluation
from palaestra_trainer.progress import Counters, Progress
from palaestra_trainer.status_server import StatusServer


class Clock:
    """A clock that is set by hand."""

    now = 0.0

    def __call__(self):
        """Tell the time."""
        return self.now


@pytest.fixture
def clock():
    """Return a clock that stands still."""
    return Clock()


@pytest.fixture
def progress(clock):
    """Return the progress of a run with two simulators."""
    return Progress(100, [("collect-0", "Collect"), ("evaluate-0", "Evaluate")], clock)


def get(server, path):
    """Return what the server answers."""
    with urllib.request.urlopen(f"http://{server.address}{path}", timeout=5) as answer:
        return answer.read().decode()


def evaluation(*, success):
    """Return an evaluation of one episode."""
    episode = Episode(seed=1, total_reward=1.0, length=3, success=success)
    return Evaluation(episodes=(episode,), faults=0, seconds=0.1)


def test_at_the_start_nothing_is_known(progress):
    """Absent is not zero."""
    status = progress.status()

    assert (status.step, status.target, status.phase) == (0, 100, "starting")
    assert status.mean_return is None
    assert status.success_rate is None
    assert status.steps_per_second is None
    assert status.last_progress is None


def test_steps_and_episodes_are_counted(progress):
    """An invalid row has no episode."""
    progress.collected(7, [{"episode": {"r": 2.0, "l": 3}, "extra_steps": 1}, {"valid": False}])

    status = progress.status()

    assert (status.step, status.episodes, status.mean_return) == (7, 1, 2.0)
    assert progress.counters.extra_steps == 1


def test_speed_is_that_of_the_last_half_minute(progress, clock):
    """A slow hour yesterday says nothing about now."""
    for second in range(100):
        clock.now = float(second)
        progress.collected(second * (1 if second < 50 else 10), [])

    assert progress.steps_per_second() == pytest.approx(10.0)


def test_a_fault_is_told_of_its_simulator(progress):
    """Which one, in which state, and why."""
    progress.ready()
    progress.fault("collect-0", SimulatorDead("collect-0", "gone"))
    broken = progress.status().simulators[0]
    progress.restarted("collect-0", recycled=False)
    mended = progress.status().simulators[0]

    assert (broken.state, broken.restarts, broken.last_fault) == ("failed", 0, "collect-0: gone")
    assert (mended.state, mended.restarts) == ("ready", 1)
    assert progress.status().simulators[1].last_fault is None


def test_recycling_is_no_restart(progress):
    """Nothing was broken."""
    progress.restarted("collect-0", recycled=True)

    assert progress.status().simulators[0].restarts == 0
    assert (progress.counters.restarts, progress.counters.recycled) == (0, 1)


def test_a_simulator_is_ready_when_it_is_up_and_not_when_all_are(progress):
    """Whoever asks which one is late must not be told of the others."""
    progress.started("collect-0")

    states = {each.name: each.state for each in progress.status().simulators}
    assert states == {"collect-0": "ready", "evaluate-0": "starting"}


def test_a_run_that_goes_on_never_says_step_0(progress):
    """From the moment that its checkpoint is found, before any simulator is up."""
    progress.resumed(40)

    assert (progress.status().step, progress.status().last_checkpoint.step) == (40, 40)


def test_restarts_of_this_attempt_are_those_of_all_simulators(progress):
    """Recycling is none; the counters have those of former attempts too."""
    progress.counters.restarts = 7
    progress.restarted("collect-0", recycled=False)
    progress.restarted("evaluate-0", recycled=False)
    progress.restarted("evaluate-0", recycled=True)

    assert progress.restarts() == 2


def test_idleness_ends_with_a_step_of_any_simulator(progress, clock):
    """An evaluation is no stall."""
    clock.now = 50.0
    before = progress.idle_s()
    progress.stepped(1)

    assert (before, progress.idle_s()) == (50.0, 0.0)


def test_counters_go_into_a_checkpoint_and_come_back(progress):
    """A run's faults are those of all its attempts."""
    progress.fault("collect-0", SimulatorHung("collect-0", "slow"))
    progress.counters.seconds = 1.5

    again = Counters.from_json(json.loads(json.dumps(progress.counters.to_json())))

    assert again == progress.counters


def test_time_is_counted_once(progress, clock):
    """Each checkpoint adds what passed since the one before, and the end the rest."""
    counted = []
    for now in (2.0, 5.0, 5.0):
        clock.now = now
        counted.append(progress.count_time().seconds)

    assert counted == [2.0, 5.0, 5.0]


def test_what_the_docstring_promises_is_there(progress):
    """And all that is there for others to read."""
    promised = set(re.findall(r"^ {4}(\w+): ", inspect.getdoc(Progress), re.MULTILINE))

    assert promised == {name for name in vars(progress) if not name.startswith("_")}


def test_the_success_rate_is_that_of_the_last_evaluation(progress):
    """A policy can get worse, and then one wants to see it."""
    progress.evaluated(evaluation(success=True))
    progress.evaluated(evaluation(success=False))

    assert progress.status().success_rate == 0.0


def test_status_is_the_protocol_s(progress):
    """The operator reads it with the same code."""
    progress.saved(50)
    with StatusServer("127.0.0.1:0", progress) as server:
        answer = json.loads(get(server, "/status"))

    assert TrainerStatus.from_json(answer) == progress.status()
    assert answer["last_checkpoint"]["step"] == 50


def test_metrics_are_the_same_numbers(progress):
    """What is unknown is absent."""
    progress.collected(7, [{"episode": {"r": 2.0, "l": 3}}])
    progress.fault("collect-0", SimulatorDead("collect-0", "gone"))
    with StatusServer("127.0.0.1:0", progress) as server:
        text = get(server, "/metrics")

    assert "palaestra_trainer_steps 7.0" in text
    assert "palaestra_trainer_episodes_total 1.0" in text
    assert 'palaestra_simulator_faults_total{kind="dead"} 1.0' in text
    assert 'palaestra_simulator_faults_total{kind="hung"} 0.0' in text
    assert "palaestra_trainer_success_ratio" not in text


def test_probes_are_answered(progress):
    """Kubernetes asks every few seconds."""
    with StatusServer("127.0.0.1:0", progress) as server:
        assert get(server, "/healthz") == "ok\n"
        with pytest.raises(urllib.error.HTTPError, match="404"):
            get(server, "/other")


def test_a_port_in_use_is_told_as_such(progress):
    """Two trainers on one laptop."""
    with (
        StatusServer("127.0.0.1:0", progress) as server,
        pytest.raises(ConfigurationError, match=r"statusAddress: 127.0.0.1:\d+ is in use"),
    ):
        StatusServer(server.address, progress)


@pytest.mark.parametrize("address", ["203.0.113.1:9090", "127.0.0.1:99999", "no.such.host.invalid:1"])
def test_an_address_that_is_not_ours_is_told_as_such(progress, address):
    """The message carries the system's own."""
    with pytest.raises(ConfigurationError, match="cannot be listened on"):
        StatusServer(address, progress)
