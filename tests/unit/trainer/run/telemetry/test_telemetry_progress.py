"""The progress of a run, and the status that it reports."""

from __future__ import annotations

import inspect
import json
import re
import urllib.error
import urllib.request

import pytest

from palaestra_protocol.pod.status import Cause, TrainerStatus
from palaestra_trainer.episodes.evaluation import Episode, EvaluationResult
from palaestra_trainer.errors import ConfigurationError, SimulatorDead, SimulatorHung
from palaestra_trainer.run.telemetry.progress import Counters, Progress
from palaestra_trainer.run.telemetry.status_server import status_server


@pytest.fixture
def progress(clock):
    """Return the progress of a run with two simulators."""
    return Progress(100, [("collect-0", "Collect"), ("evaluate-0", "Evaluate")], clock)


def get(server, path):
    """Return the response of the server to a request."""
    with urllib.request.urlopen(f"http://{server.address}{path}", timeout=5) as answer:
        return answer.read().decode()


def evaluation(*, success):
    """Return an evaluation with one episode."""
    episode = Episode(seed=1, total_reward=1.0, length=3, success=success)
    return EvaluationResult(episodes=(episode,), faults=1, seconds=0.1)


def test_at_the_start_nothing_is_known(progress):
    """An absent value differs from a value of zero."""
    status = progress.status()

    assert (status.step, status.target, status.phase) == (0, 100, "starting")
    assert status.mean_return is None
    assert status.success_rate is None
    assert status.steps_per_second is None
    assert status.last_progress is None
    assert status.last_progress_age_s is None


def test_steps_and_episodes_are_counted(progress):
    """An invalid row belongs to no episode, so it is not counted."""
    progress.collected(
        7, [{"episode": {"r": 2.0, "l": 3}, "palaestra": {"extra_steps": 1}}, {"palaestra": {"valid": False}}]
    )

    status = progress.status()

    assert (status.step, status.episodes, status.mean_return) == (7, 1, 2.0)
    assert progress.counters.extra_steps == 1


def test_speed_is_that_of_the_last_half_minute(progress, clock):
    """A slow hour yesterday must not change the speed that a person sees now."""
    for second in range(100):
        clock.now = float(second)
        progress.collected(second * (1 if second < 50 else 10), [])

    assert progress.steps_per_second() == pytest.approx(10.0)


def test_what_simulators_leave_out_is_reported_once_for_their_group():
    """The simulators of a group have the same world, even if their reports have different line numbers."""
    names = ["big-hall-0", "big-hall-1", "evaluate-0"]
    progress = Progress(100, [(name, "Collect") for name in names])
    for number, name in enumerate(names[:2]):
        lines = (f"no Drone: 1 node left out ({name}.wbt, line {7 + number})", "no Sea: ...")
        progress.reports_left_out(name, lambda lines=lines: lines)
    progress.reports_left_out("evaluate-0", lambda: ("no Sea: ...",))

    told = (
        "big-hall: no Drone: 1 node left out (big-hall-0.wbt, line 7)",
        "big-hall: no Sea: ...",
        "evaluate: no Sea: ...",
    )
    assert progress.left_out() == told
    assert progress.status().left_out == told


def test_a_fault_is_reported_for_its_simulator(progress):
    """A person sees which simulator broke, its state, and its last fault."""
    progress.started("collect-0")
    progress.fault("collect-0", SimulatorDead("collect-0", "gone"), steps_lost=0)
    broken = progress.status().simulators[0]
    progress.restarted("collect-0", recycled=False)
    mended = progress.status().simulators[0]

    assert (broken.state, broken.restarts, broken.last_fault) == ("failed", 0, "collect-0: gone")
    assert (mended.state, mended.restarts) == ("ready", 1)
    assert progress.status().simulators[1].last_fault is None


def test_recycling_is_no_restart(progress):
    """Recycling is planned, so it must not look like a fault."""
    progress.restarted("collect-0", recycled=True)

    assert progress.status().simulators[0].restarts == 0
    assert (progress.counters.restarts, progress.counters.recycled) == (0, 1)


def test_a_simulator_is_ready_when_it_is_up_and_not_when_all_are(progress):
    """A person must see which simulator is late."""
    progress.started("collect-0")

    states = {each.name: each.state for each in progress.status().simulators}
    assert states == {"collect-0": "ready", "evaluate-0": "starting"}


def test_a_run_that_goes_on_never_says_step_0(progress):
    """The step is known as soon as the checkpoint is found, before any simulator has started."""
    progress.resumed(40, Counters(episodes=3))

    status = progress.status()
    assert (status.step, status.last_checkpoint.step, status.episodes) == (40, 40, 3)


def test_restarts_of_this_attempt_are_those_of_all_simulators(progress):
    """The counters include earlier attempts, while this number is for one attempt.

    Recycling does not count.
    """
    progress.counters.restarts = 7
    progress.restarted("collect-0", recycled=False)
    progress.restarted("evaluate-0", recycled=False)
    progress.restarted("evaluate-0", recycled=True)

    assert progress.restarts() == 2


def test_idleness_ends_with_a_step_of_any_simulator(progress, clock):
    """An evaluation steps only its own simulator, and must not look like a stall."""
    clock.now = 50.0
    before = progress.idle_s()
    progress.stepped(1)

    assert (before, progress.idle_s()) == (50.0, 0.0)


def test_the_age_of_progress_is_by_a_clock_that_nobody_sets(progress, clock, monkeypatch):
    """The time of day of a node may jump by an hour, and the jump must not look like a stall."""
    clock.now = 50.0
    progress.stepped(1)
    monkeypatch.setattr("time.time", lambda: 0.0)
    clock.now = 57.5

    assert progress.status().last_progress_age_s == 7.5


def test_a_step_ends_the_age_of_progress(progress, clock):
    """A step of an evaluation counts too, because each simulator's restarter reports its steps."""
    progress.stepped(1)
    clock.now = 60.0
    before = progress.status().last_progress_age_s
    progress.stepped(1)

    assert (before, progress.status().last_progress_age_s) == (60.0, 0.0)


def test_counters_go_into_a_checkpoint_and_come_back(progress, clock):
    """A run's faults are those of all its attempts."""
    progress.fault("collect-0", SimulatorHung("collect-0", "slow"), steps_lost=0)
    clock.now = 1.5

    again = Counters.from_json(json.loads(json.dumps(progress.counted().to_json())))

    assert again == progress.counted()
    assert again.faults["hung"] == 1
    assert again.seconds == 1.5


def test_a_checkpoint_of_an_older_release_has_fewer_counters():
    """After an upgrade, a counter that the older checkpoint lacks starts at zero."""
    assert Counters.from_json({"episodes": 7, "seconds": 3.0}) == Counters(episodes=7)


def test_time_goes_on_where_the_attempt_before_ended(progress, clock):
    """Each cause continues with the seconds of the last attempt, and reading the time does not change it."""
    with progress.spending(Cause.LEARNING):
        clock.now = 5.0
    before = progress.counted()
    again = Progress(100, [("collect-0", "Collect")], clock)
    again.resumed(40, before)
    clock.now = 7.0

    counted = [again.counted() for _ in range(3)][-1]

    assert (before.seconds, counted.seconds) == (5.0, 7.0)
    assert {cause: it for cause, it in counted.goodput.items() if it} == {"learning": 5.0, "starting": 2.0}


def test_time_of_a_checkpoint_that_lacks_a_cause_stays_where_it_was(progress, clock):
    """An older release counted this time under another cause, and its checkpoint does not show which."""
    saved = Counters.from_json({"goodput": {"stepping": 3.0, "recovering": 2.0}})
    progress.resumed(40, saved)
    with progress.spending(Cause.RECYCLING):
        clock.now = 4.0

    goodput = progress.counted().goodput

    assert (goodput["stepping"], goodput["recovering"], goodput["recycling"]) == (3.0, 2.0, 4.0)


def test_a_phase_is_what_time_is_spent_on(progress):
    """A person sees in one word what the run does."""
    phases = [progress.phase]
    for cause in Cause:
        with progress.spending(cause):
            phases.append(progress.phase)

    assert phases == [
        "starting", "training", "training", "training", "evaluating", "saving", "starting", "recovering",
        "recycling",
    ]  # fmt: skip


def test_slowness_is_counted_and_breaks_nothing(progress):
    """A slow simulator is not restarted."""
    progress.started("collect-0")
    progress.slow("collect-0", 0.4)
    progress.fault("evaluate-0", SimulatorDead("evaluate-0", "gone"), steps_lost=0)

    status = progress.status()
    assert status.faults == {"dead": 1, "hung": 0, "slow": 1, "wrong_data": 0}
    assert progress.counters.broken == 1
    assert status.simulators[0].state == "ready"


def test_a_simulator_that_breaks_again_and_again_is_flapping_until_it_is_steady(progress, clock):
    """One crash in a night is an accident, but three in ten minutes are a problem."""
    progress.restarted("collect-0", recycled=False)
    once = progress.status().simulators[0].flapping
    progress.flapping("collect-0")
    thrice = progress.status().simulators[0].flapping
    clock.now = 600.0
    later = progress.status().simulators[0].flapping

    assert (once, thrice, later) == (False, True, False)


def test_a_simulator_that_was_given_up_is_reported_and_no_longer_missed(progress):
    """The run continues without this simulator, so nobody waits for it."""
    progress.started("evaluate-0")
    progress.given_up("collect-0")

    lost = progress.status().simulators[0]
    assert (lost.state, lost.given_up) == ("failed", True)
    assert progress.counters.given_up == 1
    assert progress.down() == []


def test_the_status_has_the_current_state_of_a_spare(progress):
    """A person must see whether a standby could take over now.

    A simulator without a standby has no such field.
    """
    spare = ["starting"]
    progress.has_standby("collect-0", lambda: spare[0])
    first = progress.status().simulators
    spare[0] = "ready"
    then = progress.status().simulators

    assert (first[0].standby, then[0].standby, then[1].standby) == ("starting", "ready", None)


def test_the_last_ten_faults_are_remembered(progress):
    """A person needs time, simulator, fault and step of each to find the cause."""
    for number in range(12):
        progress.collected(number, [])
        progress.fault("collect-0", SimulatorDead("collect-0", f"gone {number}"), steps_lost=0)

    faults = progress.faults()
    assert [fault.step for fault in faults] == list(range(2, 12))
    assert (faults[-1].simulator, faults[-1].kind, faults[-1].fact) == (
        "collect-0", "dead", "collect-0: gone 11",
    )  # fmt: skip
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", faults[-1].time)


def test_the_steps_of_an_episode_that_a_fault_cut_are_lost(progress):
    """The count shows the cost of faults: for example, an evaluation has to play the episode again."""
    progress.fault("collect-0", SimulatorDead("collect-0", "gone"), steps_lost=5)

    assert progress.status().steps_lost == 5


def test_the_steps_after_the_checkpoint_that_a_run_goes_on_from_are_lost(progress):
    """The checkpoint keeps this number for the next attempt. A run that is not interrupted loses no steps."""
    progress.collected(47, [])

    assert progress.counted(40).steps_lost == 7
    assert progress.counted(47).steps_lost == 0
    assert progress.counted().steps_lost == 0


def test_time_and_faults_are_drawn_over_the_steps(progress, clock):
    """In TensorBoard, a person compares a drop of the return with the faults at the same step."""
    clock.now = 2.0
    progress.fault("collect-0", SimulatorDead("collect-0", "gone"), steps_lost=0)
    progress.slow("collect-0", 0.4)

    scalars = progress.scalars()

    assert (scalars["simulators/faults"], scalars["simulators/faults_dead"]) == (1, 1)
    assert scalars["simulators/faults_slow"] == 1
    assert scalars["goodput/starting_s"] == 2.0


def test_what_the_docstring_promises_is_there(progress):
    """The docstring describes all public attributes, and no others."""
    promised = set(re.findall(r"^ {4}(\w+): ", inspect.getdoc(Progress), re.MULTILINE))

    assert promised == {name for name in vars(progress) if not name.startswith("_")}


def test_the_success_rate_is_that_of_the_last_evaluation(progress):
    """A policy may get worse, and a person must see that."""
    progress.evaluated(evaluation(success=True))
    progress.evaluated(evaluation(success=False))

    assert progress.status().success_rate == 0.0


def test_status_is_the_protocol_s(progress):
    """The operator parses the status with the same code."""
    progress.saved(50)
    with status_server("127.0.0.1:0", progress) as server:
        answer = json.loads(get(server, "/status"))

    assert TrainerStatus.from_json(answer) == progress.status()
    assert answer["last_checkpoint"]["step"] == 50


def test_metrics_are_the_same_numbers(progress):
    """Status and dashboards must not contradict each other; unknown values are absent from the metrics."""
    progress.collected(7, [{"episode": {"r": 2.0, "l": 3}}])
    progress.fault("collect-0", SimulatorDead("collect-0", "gone"), steps_lost=0)
    with status_server("127.0.0.1:0", progress) as server:
        text = get(server, "/metrics")

    assert "palaestra_trainer_steps_total 7.0" in text
    assert "palaestra_trainer_episodes_total 1.0" in text
    assert 'palaestra_simulator_faults_total{kind="dead",simulator="collect-0"} 1.0' in text
    assert 'palaestra_simulator_faults_total{kind="hung",simulator="collect-0"} 0.0' in text
    assert 'palaestra_trainer_seconds_total{cause="starting"} 0.0' in text
    assert "palaestra_trainer_steps_lost_total 0.0" in text
    assert "\npalaestra_trainer_evaluation_success_ratio" not in text


def test_probes_are_answered(progress):
    """Kubernetes sends a probe every few seconds."""
    with status_server("127.0.0.1:0", progress) as server:
        assert get(server, "/healthz") == "ok\n"
        with pytest.raises(urllib.error.HTTPError, match="404"):
            get(server, "/other")


def test_a_port_in_use_is_reported_as_such(progress):
    """Two trainers may run on one laptop."""
    with (
        status_server("127.0.0.1:0", progress) as server,
        pytest.raises(ConfigurationError, match=r"statusAddress: 127.0.0.1:\d+ is in use"),
    ):
        status_server(str(server.address), progress)


@pytest.mark.parametrize("address", ["203.0.113.1:9090", "127.0.0.1:99999", "no.such.host.invalid:1"])
def test_an_address_that_is_not_ours_is_reported_as_such(progress, address):
    """The message has the error of the operating system."""
    with pytest.raises(ConfigurationError, match="cannot be listened on"):
        status_server(address, progress)
