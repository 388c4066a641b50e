"""The fleet of all simulators of a run."""

from __future__ import annotations

import os
import signal
import threading
from concurrent.futures import wait
from pathlib import Path

import pytest
import structlog

from palaestra_protocol.pod.status import ExitCode
from palaestra_trainer.errors import (
    ConfigurationError,
    FaultBudgetSpent,
    SimulatorDead,
    SimulatorHung,
    SimulatorRefused,
    WorldMisfit,
    WrongData,
)
from palaestra_trainer.job.configuration import parse
from palaestra_trainer.run.signals import Interrupted, Interruption
from palaestra_trainer.simulators.budget import RestartLimit
from palaestra_trainer.simulators.fleet import Fleet, resting
from palaestra_trainer.simulators.interface import NullWatcher
from palaestra_trainer.simulators.restarter import Restarter, await_one

DEADLINE_S = 5.0


class Told(NullWatcher):
    """A watcher that records its calls."""

    def __init__(self):
        self.told = []

    def restarted(self, simulator, *, recycled):
        """Record the call."""
        assert not recycled
        self.told.append(f"restarted {simulator}")

    def flapping(self, simulator):
        """Record the call."""
        self.told.append(f"flapping {simulator}")

    def given_up(self, simulator):
        """Record the call."""
        self.told.append(f"given up {simulator}")


@pytest.fixture
def make_fleet(make_configuration, make_member):
    """Make a fleet of two members; the arguments are for the first one."""

    def make(first=None, **faults):
        members = [first or make_member("collect-0", **faults), make_member("evaluate-0")]
        return Fleet(make_configuration(), members, NullWatcher()), members

    return make


def test_all_are_started_and_stopped(make_fleet):
    """The test has collecting and evaluating simulators."""
    fleet, members = make_fleet()

    fleet.start()
    fleet.stop()

    assert [member.log for member in members] == [["start", "stop"]] * 2


def test_one_that_does_not_come_up_ends_the_start(make_fleet):
    """Its budget limits the number of attempts."""
    fleet, members = make_fleet(starts=range(1, 100))

    with pytest.raises(FaultBudgetSpent, match="collect-0: flapping: 10 restarts"):
        fleet.start()

    assert members[0].log == ["start", *["restart"] * 10]


def misfit_starts(*numbers):
    """Return starts at which the world lacks a required node."""
    return {number: WorldMisfit("collect-0", "the world has no node DEF TARGET") for number in numbers}


def test_two_processes_in_a_row_that_lack_what_is_needed_are_a_wrong_configuration(make_fleet):
    """A retry cannot help, because the world is the same each time."""
    fleet, members = make_fleet(starts=misfit_starts(1, 2))

    with pytest.raises(ConfigurationError, match="collect-0: collect-0: the world has no node DEF TARGET"):
        fleet.start()

    assert members[0].log == ["start", "restart"]


@pytest.mark.parametrize(
    "starts",
    [misfit_starts(1), misfit_starts(1, 3) | {2: SimulatorDead("collect-0", "died")}],
    ids=["one", "two with another fault between"],
)
def test_a_misfit_that_the_next_process_does_not_repeat_is_mended(make_fleet, starts):
    """A process may respond before its world is loaded completely."""
    fleet, members = make_fleet(starts=starts)

    fleet.start()

    assert members[0].log == ["start", *["restart"] * len(starts)]


def test_a_run_that_has_stepped_before_mends_misfits_like_other_faults(make_fleet):
    """The run has stepped, so its worlds are valid."""
    fleet, members = make_fleet(starts=misfit_starts(1, 2, 3))

    fleet.start(stepped=True)

    assert members[0].log == ["start", *["restart"] * 3]


def refusals(*numbers, fact="refused a step of 50 ms; use a multiple of the world's basicTimeStep"):
    """Return starts, resets or steps at which the simulator refuses a request."""
    return {number: WrongData("collect-0", fact) for number in numbers}


@pytest.mark.parametrize("what", ["starts", "resets", "steps"])
def test_what_two_processes_refuse_in_the_same_words_is_a_mistake(play, make_configuration, last_word, what):
    """A period that is not a multiple of the basic step once looked like a simulator that broke ten times."""
    code, members = play(make_configuration(), faults={"collect-0": {what: refusals(1, 2, 3)}})

    assert code == ExitCode.CONFIGURATION
    assert "use a multiple of the world's basicTimeStep" in last_word().reason
    assert members["collect-0"].log.count("restart") == 1


def test_a_simulator_that_refuses_its_variables_twice_is_a_mistake(play, make_configuration, last_word):
    """It ends with exit code 2 each time, and ten restarts would not correct PALAESTRA_STUB_FAULTS."""
    said = "the simulator ended with code 2; its last line: 'exit@step=45' is not a fault"
    starts = {number: SimulatorRefused("collect-0", said) for number in (1, 2, 3)}

    code, members = play(make_configuration(), faults={"collect-0": {"starts": starts}})

    assert code == ExitCode.CONFIGURATION
    assert "'exit@step=45' is not a fault" in last_word().reason
    assert members["collect-0"].log.count("restart") == 1


@pytest.mark.parametrize(
    "faults",
    [
        {"steps": refusals(2, 3)},
        {"steps": refusals(1) | refusals(2, fact="sent 3 of 4 bytes")},
        {"starts": refusals(1), "steps": [1, 2]},
    ],
    ids=["after a step", "in other words", "then something else"],
)
def test_what_one_process_refuses_is_mended(play, make_configuration, faults):
    """A simulator that worked before is broken, but the configuration is right."""
    code, _ = play(make_configuration(), faults={"collect-0": faults})

    assert code == ExitCode.DONE


def test_simulators_that_take_long_to_come_up_are_named(make_fleet, make_member, monkeypatch):
    """The log names the late simulator before its deadline turns it into a fault."""
    monkeypatch.setattr("palaestra_trainer.simulators.fleet.LONG_S", 0.0)
    released = threading.Event()
    member = make_member("collect-0")
    member.start = lambda: released.wait(DEADLINE_S)
    fleet, _ = make_fleet(member)

    with structlog.testing.capture_logs() as logs:
        fleet.start(lambda: released.set() if logs else None)
    fleet.stop()

    waits = [each for each in logs if each["event"] == "waiting for simulators"]
    assert "collect-0" in waits[0]["names"]
    assert waits[0]["waited_s"] == 0


def test_a_signal_does_not_wait_for_simulators_that_start(make_fleet, make_member):
    """Eleven attempts of a minute each are long after Ctrl-C."""
    released = threading.Event()
    member = make_member("collect-0")

    def start():
        member.log.append("start")
        threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT)).start()
        released.wait(DEADLINE_S)
        raise SimulatorHung("collect-0", "slow")

    member.start = start
    fleet, _ = make_fleet(member)

    with Interruption() as interruption, pytest.raises(Interrupted):
        fleet.start(interruption.check)
    released.set()
    for thread in threading.enumerate():
        if thread.name == "restarter-collect-0":
            thread.join(DEADLINE_S)

    assert member.log == ["start"]


def with_fewer(configuration, least):
    """Return the configuration with `minSimulators` for each group."""
    content = configuration.model_dump(by_alias=True)
    for simulator in content["simulators"]:
        simulator["minSimulators"] = least
    return parse(content)


def test_training_begins_when_enough_of_each_group_are_up(make_configuration, make_member):
    """The missing one is restarted while the others learn."""
    members = [make_member("collect-0", starts=[1], held=True), make_member("collect-1")]
    watcher = Told()
    fleet = Fleet(with_fewer(make_configuration(collectors=2, evaluators=0), 1), members, watcher)

    fleet.start()

    assert [restarter.busy for restarter in fleet.collecting] == [True, False]
    assert "restarted collect-0" not in watcher.told
    members[0].release.set()
    wait([work for restarter in fleet.collecting if (work := restarter.under_way)], DEADLINE_S)
    assert all(restarter.up() for restarter in fleet.collecting)
    assert watcher.told[-1] == "restarted collect-0"


def test_one_that_fails_after_the_others_are_up_is_not_waited_for(make_configuration, make_member):
    """From then on it is restarted in the background, like any other."""
    up = threading.Event()
    late = make_member("collect-0", held=True)

    def fail():
        assert up.wait(DEADLINE_S)
        raise SimulatorDead("collect-0", "does not come up")

    late.start = fail
    configuration = with_fewer(make_configuration(collectors=2, evaluators=0), 1)
    fleet = Fleet(configuration, [late, make_member("collect-1")], NullWatcher())

    fleet.start(lambda: fleet.collecting[1].up() and up.set())

    assert fleet.collecting[0].busy
    late.release.set()
    fleet.stop()


def test_training_does_not_begin_before_every_one_was_tried(make_configuration, make_member):
    """Usually all start, and the first steps should include all of them."""
    released = threading.Event()
    slow = make_member("collect-0")
    slow.start = lambda: released.wait(DEADLINE_S)
    looks = []

    def check():
        looks.append(1)
        if len(looks) == 3:
            released.set()

    fleet = Fleet(
        with_fewer(make_configuration(collectors=2, evaluators=0), 1),
        [slow, make_member("collect-1")],
        NullWatcher(),
    )

    fleet.start(check)

    assert len(looks) >= 3
    assert all(restarter.up() for restarter in fleet.collecting)


def test_a_simulator_that_never_comes_up_is_given_up_if_enough_are_left(make_configuration, make_member):
    """One broken machine in a pool must not keep the others from learning."""
    members = [make_member("collect-0", starts=range(1, 100)), make_member("collect-1")]
    watcher = Told()
    fleet = Fleet(with_fewer(make_configuration(collectors=2, evaluators=0), 1), members, watcher)

    fleet.start()
    wait([work for restarter in fleet.collecting if (work := restarter.under_way)], DEADLINE_S)

    assert [restarter.lost for restarter in fleet.collecting] == [True, False]
    assert watcher.told[-1] == "given up collect-0"
    assert watcher.told.count("flapping collect-0") == 8


def test_stopping_ends_a_mending_that_is_under_way(make_fleet):
    """No thread may use a simulator that its owner has stopped."""
    fleet, members = make_fleet(held=True)
    fleet.start()
    (restarter,) = fleet.collecting
    restarter.begin_restart(SimulatorHung("collect-0", "slow"))

    fleet.stop()

    assert not restarter.busy
    assert members[0].log == ["start", "restart", "stop"]


def test_a_member_that_is_mended_neither_rests_nor_runs(make_fleet):
    """Only the restarting thread may use it."""
    fleet, members = make_fleet(held=True)
    fleet.start()
    fleet.collecting[0].begin_restart(SimulatorHung("collect-0", "slow"))

    with resting(fleet.collecting):
        pass

    fleet.stop()
    assert members[0].log == ["start", "restart", "stop"]


def test_a_resting_member_is_recycled_in_the_background_and_awaited_before_it_runs(make_member):
    """The others collect meanwhile; a member that is paused in between would step while paused."""
    member = make_member(recycle_after=1, held=True)
    restarter = Restarter(member)
    restarter.reset(seed=1)

    restarter.recycle_resting(episodes=1)
    busy = restarter.busy
    restarter.unpause(check=member.release.set)

    assert busy
    assert member.log == ["restart", "pause", "run"]


def test_a_resting_member_that_is_not_due_stays_as_it_is(make_member):
    """Its next evaluation ends before its limit is reached."""
    member = make_member(recycle_after=24)
    restarter = Restarter(member)
    restarter.reset(seed=1)

    restarter.recycle_resting(episodes=20)

    assert not restarter.busy
    assert member.log == []


def test_a_recycling_at_rest_that_fails_is_mended_when_the_member_is_to_run(make_member):
    """It is again restarted in the background, because another simulator may take its episodes."""
    member = make_member(recycle_after=1, starts=[1])
    restarter = Restarter(member)
    restarter.reset(seed=1)

    restarter.recycle_resting(episodes=1)
    restarter.unpause()
    await_one([restarter])

    assert restarter.up()
    assert member.log.count("restart") == 2


def test_stopping_ends_a_recycling_at_rest_and_reports_no_fault(make_fleet, make_member):
    """A signal may come while the simulators are healthy, and their end is then not a fault."""
    member = make_member("collect-0", recycle_after=1, held=True)
    fleet, _ = make_fleet(member)
    fleet.start()
    [restarter] = fleet.collecting
    restarter.reset(seed=1)

    restarter.recycle_resting(episodes=1)
    with structlog.testing.capture_logs() as logs:
        fleet.stop()

    assert member.log == ["start", "restart", "stop"]
    assert [line for line in logs if line["event"] == "simulator fault"] == []


def test_fifty_faults_leave_nothing_behind(make_member):
    """Neither threads nor descriptors: a week of training has many more."""
    restarter = Restarter(make_member(), RestartLimit(restarts=50))
    threads, descriptors = threading.active_count(), len(list(Path("/proc/self/fd").iterdir()))

    for number in range(50):
        restarter.begin_restart(SimulatorHung("collect-0", f"fault {number}"))
        await_one([restarter])
        assert restarter.up()
    for thread in threading.enumerate():
        if thread.name == "restarter-collect-0":
            thread.join(DEADLINE_S)

    assert threading.active_count() == threads
    assert len(list(Path("/proc/self/fd").iterdir())) == descriptors
