"""A member with a spare, on real stubs: after any failure of one simulator, the other takes over."""

import os
import signal
import sys
import threading
import time
from pathlib import Path

import gymnasium
import pytest

import palaestra_trainer.environments  # noqa: F401 - registers the environment
from palaestra_protocol.control import SidecarState
from palaestra_trainer.errors import SimulatorDead, SimulatorFault, SimulatorHung
from palaestra_trainer.job.simulator_configuration import Recycle
from palaestra_trainer.simulators.budget import RestartLimit
from palaestra_trainer.simulators.restarter import Restarter, settle
from palaestra_trainer.simulators.simulator import Simulator
from palaestra_trainer.simulators.standby import Standby
from palaestra_trainer.webots import Mode
from palaestra_trainer.webots.launching.local_simulator import ProcessLauncher
from tests.waiting import eventually

PATIENCE_S = 60.0
START_DEADLINE_S = 60.0
LONG_S = 30.0  # a change of roles takes milliseconds, and a start may take a minute


class Pair:
    """A member of a run with two simulators, of which one is the spare."""

    def __init__(self, launcher, recycle, limit):
        def make(robot, scene):
            return gymnasium.make("MoveToTargetEnv-v0", disable_env_checker=True, robot=robot, scene=scene)

        self.launcher = launcher
        self.first, self.second = (
            Simulator("collect-0", sidecar, make, START_DEADLINE_S, recycle)
            for sidecar in (launcher, launcher.standby())
        )
        self.member = Standby(self.first, self.second, limit)

    def begin(self):
        """Start the member, wait until the spare is ready, and begin an episode."""
        self.member.start()
        self.wait_for_spare()
        self.member.env.reset(seed=1)
        return self

    def wait_for_spare(self):
        """Wait until the spare is ready."""
        give_up = time.monotonic() + PATIENCE_S
        while self.member.spare() == "starting":
            assert time.monotonic() < give_up
            time.sleep(0.01)
        assert self.member.spare() == "ready"

    def play(self):
        """Take steps until the simulator fails."""
        for _ in range(200):
            self.member.env.step(0)

    def plays_in(self, simulator):
        """Begin an episode and take a step; return whether the member uses that simulator."""
        self.member.env.reset(seed=2)
        self.member.env.step(0)
        return self.member.env is simulator.env


def pid_of(simulator):
    """Return the process id of a member's simulator."""
    return simulator.sidecar.state().pid


@pytest.fixture
def pair(master, tmp_path):
    """Yield a function that returns a member with a spare, which has not been started.

    At the end of the test, the sidecar ends with both simulators.
    """
    del master
    made = []

    def make(*options, recycle=None, limit=None):
        names = ("--job=pair", f"--uid={tmp_path.name}", f"--work={tmp_path}", "--standby")
        launcher = ProcessLauncher("arena", options=options, names=names)
        made.append(Pair(launcher, recycle, limit))
        return made[-1]

    yield make
    for each in made:
        each.member.stop()
        each.launcher.close()


def test_a_killed_simulator_is_replaced_by_the_one_that_stood_by(pair, capsys):
    """The kernel, too, sends SIGKILL, for too much memory. docs/explain/reliability.md lists the times."""
    it = pair().begin()
    os.kill(pid_of(it.first), signal.SIGKILL)

    killed = time.monotonic()
    with pytest.raises(SimulatorDead):
        it.play()
    it.member.restart()
    swapped_s = time.monotonic() - killed
    played = it.plays_in(it.second)
    stepping_s = time.monotonic() - killed

    with capsys.disabled():
        figures = f"took over after {swapped_s * 1000:.0f} ms, stepped after {stepping_s * 1000:.0f} ms"
        sys.stdout.write(f"\nSIGKILL: the spare {figures}\n")
    assert played
    assert "_0b_robotino_" in it.second.webots.supervisor_node_name
    assert swapped_s < LONG_S


def test_the_one_that_was_killed_becomes_the_next_spare(pair):
    """With a new spare, the next fault costs no more time than this one."""
    it = pair().begin()
    for broken, next_ in ((it.first, it.second), (it.second, it.first)):
        os.kill(pid_of(broken), signal.SIGKILL)
        with pytest.raises(SimulatorDead):
            it.play()
        it.member.restart()
        assert it.plays_in(next_)
        it.wait_for_spare()

    assert it.first.sidecar.state().starts == 2


def test_a_recycled_simulator_is_ended_and_is_no_fault(pair):
    """The member changes simulators between two episodes, and the new simulator has no resets."""
    it = pair(recycle=Recycle(after_resets=2)).begin()
    it.member.env.reset(seed=3)

    due = it.member.due()
    it.member.restart()

    assert due == "2 resets"
    assert it.plays_in(it.second)
    assert (it.member.resets, it.member.due()) == (1, None)
    it.wait_for_spare()
    assert it.first.sidecar.state().faults == 0


def test_a_hanging_simulator_is_not_waited_for(pair):
    """Its process is killed in the background, because a kill takes time."""
    it = pair().begin()
    hung = pid_of(it.first)
    os.kill(hung, signal.SIGSTOP)

    begin = time.monotonic()
    it.member.restart()

    assert time.monotonic() - begin < LONG_S
    assert it.plays_in(it.second)
    it.wait_for_spare()
    assert not Path(f"/proc/{hung}").exists()


def test_a_spare_that_is_not_ready_yet_is_waited_for(pair):
    """The second of two faults in a row costs a start, as it would without a spare."""
    it = pair().begin()

    it.member.restart()
    it.member.restart()

    assert it.plays_in(it.first)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_broken_spare_fails_one_restart_and_the_next_one_succeeds(pair, number):
    """Each failure is a separate fault, and no restart waits longer than for one start."""
    it = pair().begin()
    os.kill(pid_of(it.second), number)

    with pytest.raises(SimulatorDead, match="its standby no longer responds"):
        it.member.restart()
    it.member.restart()

    assert it.plays_in(it.first)
    it.wait_for_spare()


def test_a_spare_that_does_not_come_up_is_tried_again_while_nobody_waits(pair):
    """Without another attempt, the next fault would cost a start, even long after the refusal."""
    it = pair("--fault=start_refused:start=2").begin()

    it.member.restart()
    it.wait_for_spare()
    it.member.restart()

    assert it.plays_in(it.first)
    assert it.first.sidecar.state().starts == 3


def test_a_spare_that_does_not_start_within_its_budget_fails_the_restart_that_needs_it(pair):
    """The working simulator must continue until its own fault."""
    it = pair("--fault=start_refused:start=2", limit=RestartLimit(restarts=0))
    it.member.start()
    it.member.restart()
    it.member.env.reset(seed=1)

    with pytest.raises(SimulatorFault):
        it.member.restart()

    assert it.member.spare() in {"starting", None}


def test_a_spare_is_waited_for_as_long_as_a_simulator_may_take_to_start(pair):
    """A member that waits blocks all other members, so the wait must be limited."""
    it = pair("--fault=slow_start:latency_ms=600000,start=2").begin()
    it.member.restart()
    it.first.start_deadline_s = 0.5

    with pytest.raises(SimulatorHung, match=r"its standby was not ready within 0\.5 s"):
        it.member.restart()


def test_a_spare_rests_until_it_takes_over(pair):
    """A spare that steps would take processor time from the simulator in use."""
    it = pair().begin()

    modes = [each.webots.observer.mode() for each in (it.first, it.second)]
    it.member.restart()

    assert modes == [Mode.FAST, Mode.PAUSE]
    assert it.second.webots.observer.mode() is Mode.FAST


def test_a_simulator_that_takes_too_much_memory_is_due(pair):
    """The sidecar measures the memory of all processes of the simulator, once per second."""
    it = pair("--fault=memory_growth:mib=20,most_mib=300", recycle=Recycle(above_memory_bytes=200 * 2**20))
    it.begin()
    before = it.member.due()
    for _ in range(15):
        it.member.env.step(0)

    give_up = time.monotonic() + PATIENCE_S
    while (due := it.member.due()) is None and time.monotonic() < give_up:
        time.sleep(0.05)

    assert before is None
    assert due.endswith(" MiB of memory")


def test_a_stop_while_the_spare_starts_leaves_no_process_and_no_thread(pair):
    """A run may end at any time, and its end must not wait for a start."""
    it = pair("--fault=slow_start:latency_ms=600000,start=2").begin()
    it.member.restart()

    begin = time.monotonic()
    it.member.stop()

    assert time.monotonic() - begin < LONG_S
    for simulator in (it.first, it.second):
        state = simulator.sidecar.state()
        assert (state.state in {SidecarState.IDLE, SidecarState.FAILED}, state.pid) == (True, None)
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("standby-")]


def test_a_start_that_a_restart_waits_for_is_not_begun_again_once_it_is_abandoned(pair):
    """A run that ends gives each simulator only seconds, even if the budget allows more starts."""
    held = [f"--fault=slow_start:latency_ms=600000,start={start}" for start in range(2, 60)]
    it = pair(*held, limit=RestartLimit(restarts=1000)).begin()
    it.member.restart()
    restarter = Restarter(it.member, RestartLimit(restarts=1000))
    restarter.begin_restart(SimulatorDead("collect-0", "gone"))
    give_up = time.monotonic() + PATIENCE_S
    while it.first.sidecar.state().starts < 2:
        assert time.monotonic() < give_up
        time.sleep(0.01)

    begin = time.monotonic()
    settle([restarter])

    assert not restarter.busy
    assert time.monotonic() - begin < LONG_S


def test_what_was_stopped_can_be_started_again(pair):
    """Every member of a run can be started again after a stop."""
    it = pair().begin()
    it.member.stop()

    it.begin()
    it.member.restart()

    assert it.plays_in(it.second)


def descriptors():
    """Return the number of open files of this process."""
    return len(list(Path("/proc/self/fd").iterdir()))


def test_changing_places_again_and_again_leaves_no_file_open(pair):
    """A run of a week may change simulators ten thousand times."""
    it = pair().begin()
    opened = []
    for _ in range(4):
        it.member.restart()
        it.member.env.reset(seed=1)
        it.member.env.step(0)
        it.wait_for_spare()
        opened.append(descriptors())

    eventually(lambda: descriptors() <= opened[1])  # a master's call to our node may still be open
