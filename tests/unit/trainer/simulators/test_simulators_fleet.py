"""The fleet: all simulators of a run, their start, their faults and their end."""

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
    """A watcher that records which of its methods were called."""

    def __init__(self):
        self.told = []

    def restarted(self, simulator, *, recycled):
        """Record the restart."""
        assert not recycled
        self.told.append(f"restarted {simulator}")

    def flapping(self, simulator):
        """Record that the simulator is flapping."""
        self.told.append(f"flapping {simulator}")

    def given_up(self, simulator):
        """Record that the simulator was given up."""
        self.told.append(f"given up {simulator}")


@pytest.fixture
def make_fleet(make_configuration, make_member):
    """Return a function that makes a fleet of two simulators; the keywords set the first one's faults."""

    def make(first=None, **faults):
        members = [first or make_member("collect-0", **faults), make_member("evaluate-0")]
        return Fleet(make_configuration(), members, NullWatcher()), members

    return make


def test_all_are_started_and_stopped(make_fleet):
    """The process of a simulator that was not stopped would outlive the run."""
    fleet, members = make_fleet()

    fleet.start()
    fleet.stop()

    assert [member.log for member in members] == [["start", "stop"]] * 2


def test_one_that_does_not_come_up_ends_the_start(make_fleet):
    """The budget limits the number of tries."""
    fleet, members = make_fleet(starts=range(1, 100))

    with pytest.raises(FaultBudgetSpent, match="collect-0: flapping: 10 restarts"):
        fleet.start()

    assert members[0].log == ["start", *["restart"] * 10]


def misfit_starts(*numbers):
    """Return starts at which the world lacks a node that the environment needs."""
    return {number: WorldMisfit("collect-0", "the world has no node DEF TARGET") for number in numbers}


def test_two_processes_in_a_row_that_lack_what_is_needed_are_a_wrong_configuration(make_fleet):
    """The world is the same each time, so a retry cannot help."""
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
    """A process may answer before it has loaded its world completely."""
    fleet, members = make_fleet(starts=starts)

    fleet.start()

    assert members[0].log == ["start", *["restart"] * len(starts)]


def test_a_run_that_has_stepped_before_mends_misfits_like_other_faults(make_fleet):
    """The worlds of such a run have all nodes, so the misfit must have another cause."""
    fleet, members = make_fleet(starts=misfit_starts(1, 2, 3))

    fleet.start(stepped=True)

    assert members[0].log == ["start", *["restart"] * 3]


def refusals(*numbers, fact="refused a step of 50 ms; use a multiple of the world's basicTimeStep"):
    """Return starts, resets or steps at which the simulator rejects a request."""
    return {number: WrongData("collect-0", fact) for number in numbers}


@pytest.mark.parametrize("what", ["starts", "resets", "steps"])
def test_what_two_processes_refuse_in_the_same_words_is_a_mistake(play, make_configuration, last_word, what):
    """A restart cannot help if each process refuses the same request, such as a wrong period."""
    code, members = play(make_configuration(), faults={"collect-0": {what: refusals(1, 2, 3)}})

    assert code == ExitCode.CONFIGURATION
    assert "use a multiple of the world's basicTimeStep" in last_word().reason
    assert members["collect-0"].log.count("restart") == 1


def test_a_simulator_that_refuses_its_variables_twice_is_a_mistake(play, make_configuration, last_word):
    """The simulator exits with code 2 each time, and a restart cannot correct PALAESTRA_STUB_FAULTS."""
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
    """If the next process accepts the same request, the configuration is right."""
    code, _ = play(make_configuration(), faults={"collect-0": faults})

    assert code == ExitCode.DONE


def test_simulators_that_take_long_to_come_up_are_named(make_fleet, make_member, monkeypatch):
    """A person sees in the log which simulator is late, before the deadline makes it a fault."""
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
    """Eleven tries of a minute each would be a long wait after Ctrl-C."""
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
    """Return the configuration with this `minSimulators` in each group."""
    content = configuration.model_dump(by_alias=True)
    for simulator in content["simulators"]:
        simulator["minSimulators"] = least
    return parse(content)


def test_training_begins_when_enough_of_each_group_are_up(make_configuration, make_member):
    """The missing simulator is restarted while the others collect."""
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
    """Like a simulator that breaks later, it is restarted in the background."""
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
    """Usually all simulators start, so the first steps should have all of them."""
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
    """One broken machine in a pool must not keep the others from training."""
    members = [make_member("collect-0", starts=range(1, 100)), make_member("collect-1")]
    watcher = Told()
    fleet = Fleet(with_fewer(make_configuration(collectors=2, evaluators=0), 1), members, watcher)

    fleet.start()
    wait([work for restarter in fleet.collecting if (work := restarter.under_way)], DEADLINE_S)

    assert [restarter.lost for restarter in fleet.collecting] == [True, False]
    assert watcher.told[-1] == "given up collect-0"
    assert watcher.told.count("flapping collect-0") == 8


def test_stopping_ends_a_mending_that_is_under_way(make_fleet):
    """After the end of the fleet, no thread may use a simulator."""
    fleet, members = make_fleet(held=True)
    fleet.start()
    (restarter,) = fleet.collecting
    restarter.begin_restart(SimulatorHung("collect-0", "slow"))

    fleet.stop()

    assert not restarter.busy
    assert members[0].log == ["start", "restart", "stop"]


def test_a_member_that_is_mended_neither_rests_nor_runs(make_fleet):
    """During a restart, only the restarter's thread may use the simulator."""
    fleet, members = make_fleet(held=True)
    fleet.start()
    fleet.collecting[0].begin_restart(SimulatorHung("collect-0", "slow"))

    with resting(fleet.collecting):
        pass

    fleet.stop()
    assert members[0].log == ["start", "restart", "stop"]


def test_a_resting_member_is_recycled_in_the_background_and_awaited_before_it_runs(make_member):
    """The other simulators collect meanwhile.

    The restarted simulator is paused and unpaused only after its restart.
    """
    member = make_member(recycle_after=1, held=True)
    restarter = Restarter(member)
    restarter.reset(seed=1)

    restarter.recycle_resting(episodes=1)
    busy = restarter.busy
    restarter.unpause(check=member.release.set)

    assert busy
    assert member.log == ["restart", "pause", "run"]


def test_a_resting_member_that_is_not_due_stays_as_it_is(make_member):
    """The simulator's next evaluation ends before the limit is reached."""
    member = make_member(recycle_after=24)
    restarter = Restarter(member)
    restarter.reset(seed=1)

    restarter.recycle_resting(episodes=20)

    assert not restarter.busy
    assert member.log == []


def test_a_recycling_at_rest_that_fails_is_mended_when_the_member_is_to_run(make_member):
    """The second restart is in the background too, because another simulator may take over the episodes."""
    member = make_member(recycle_after=1, starts=[1])
    restarter = Restarter(member)
    restarter.reset(seed=1)

    restarter.recycle_resting(episodes=1)
    restarter.unpause()
    await_one([restarter])

    assert restarter.up()
    assert member.log.count("restart") == 2


def test_stopping_ends_a_recycling_at_rest_and_reports_no_fault(make_fleet, make_member):
    """The simulators are healthy when a signal ends the run, so their end is not a fault."""
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
    """A week of training has many more faults, so each must free its threads and descriptors."""
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
