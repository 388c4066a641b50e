"""Two simulators in one sidecar, so that one can start while the other works: they share nothing."""

import json
import os
import re
import signal
from pathlib import Path

import pytest

from palaestra_protocol.control import LastExit, SidecarState, SimulatorState
from palaestra_sim.sidecar.reaper import children
from palaestra_sim.world import RunIdentity, robots, ros_name
from tests.integration.sidecar.conftest import ENDS, was_seen

IDLE, STARTING, READY, STOPPING, FAILED = SidecarState
FIRST, SECOND = "", "/standby"


class Two:
    """A sidecar with two simulators, each identified by the prefix of its paths."""

    def __init__(self, sidecar, eventually) -> None:
        self.it = sidecar
        self._eventually = eventually

    def state(self, above, address=None):
        """Return the state that it reports for one of them."""
        status, text = self.it.ask("GET", f"{above}/state", address=address)
        assert status == 200, text
        return SimulatorState.from_json(json.loads(text))

    def start(self, above):
        """Start one, and return its state once it has printed `up` and is known to run."""
        line = {FIRST: "a: up", SECOND: "b: up"}[above]
        ups = self.it.lines.count(line) + 1
        self.it.request(f"{above}/start")
        self._eventually(lambda: self.it.lines.count(line) >= ups and was_seen(self.state(above)))
        return self.state(above)

    def until(self, above, wanted):
        """Return the state of one as soon as it is `wanted`."""
        self._eventually(lambda: self.state(above).state is wanted)
        return self.state(above)


@pytest.fixture
def two(sidecar, tmp_path, eventually_true):
    """Return a function that runs a sidecar whose two simulators are the same program."""

    def run(program):
        given = (f"--work={tmp_path}/work", "--job=j", "--uid=u", "--clock", "--standby")
        return Two(sidecar(program, *given), eventually_true)

    return run


def test_each_has_a_world_with_names_of_its_own(two, waits) -> None:
    """Slot b needs another readable part and another hash.

    With equal names each would remove the other from the ROS master.
    """
    it = two(waits)

    for above, slot, file in ((FIRST, "a", "collect-0.wbt"), (SECOND, "b", "collect-0b.wbt")):
        identity = RunIdentity(job="j", uid="u", replica=0, group="collect", index=0, slot=slot)
        state = it.state(above)
        (robot,) = robots(Path(state.world).read_bytes())
        assert Path(state.world).name == file
        assert state.robots[0].ros_name == robot.ros_name == ros_name(identity, "robotino")


def test_the_one_that_stands_by_keeps_no_clock(two, waits) -> None:
    """Only one simulator per ROS master publishes /clock, even when both run."""
    it = two(waits)

    assert b"--clock" in Path(it.state(FIRST).world).read_bytes()
    assert b"--clock" not in Path(it.state(SECOND).world).read_bytes()


def test_each_is_started_and_stopped_by_itself(two, waits) -> None:
    """The trainer decides which of them is in use; for the sidecar both are equal."""
    it = two(waits)

    first, second = it.start(FIRST), it.start(SECOND)
    it.it.request("/standby/ready")
    it.it.request("/stop", {"deadline_s": 0})
    it.until(FIRST, IDLE)

    assert first.pid != second.pid
    assert it.state(SECOND).state is READY
    assert it.state(SECOND).pid == second.pid


@pytest.mark.parametrize(("broken", "whole"), [(FIRST, SECOND), (SECOND, FIRST)])
def test_one_that_dies_is_no_matter_of_the_other(two, waits, broken, whole) -> None:
    """Each simulator has its own fault, its own count of faults, and its own next start."""
    it = two(waits)
    pid, other = it.start(broken).pid, it.start(whole).pid

    os.kill(pid, signal.SIGKILL)
    failed = it.until(broken, FAILED)
    again = it.start(broken)

    assert failed.last_exit == LastExit(code=None, signal="SIGKILL", expected=False)
    assert (again.starts, again.faults) == (2, 1)
    assert (it.state(whole).starts, it.state(whole).faults, it.state(whole).pid) == (1, 0, other)


def test_a_killed_reaper_takes_its_own_simulator_along_and_no_other(
    two, family, left, eventually_true
) -> None:
    """The sidecar inherits the simulator's processes. The other reaper is its child, but not an orphan."""
    it = two(family)
    sidecar = it.it.process.pid
    it.start(FIRST)
    (reaper,) = children({sidecar})
    it.start(SECOND)

    os.kill(reaper, signal.SIGKILL)
    it.until(FIRST, FAILED)

    eventually_true(lambda: len(left()) == 6)  # the sidecar, and reaper, simulator and three more
    assert it.state(SECOND).state is STARTING
    assert len(children({sidecar})) == 1


@pytest.mark.parametrize("what", ["waits", "stubborn", "family"])
def test_a_signal_ends_both(two, request, left, eventually_true, what) -> None:
    """A signal ends one simulator in the same way."""
    it = two(request.getfixturevalue(what))
    it.start(FIRST)
    it.start(SECOND)

    assert it.it.end() in ENDS
    eventually_true(lambda: not left())


def test_a_killed_sidecar_leaves_neither(two, family, left, eventually_true) -> None:
    """Each reaper sees the end of its own pipe."""
    it = two(family)
    it.start(FIRST)
    it.start(SECOND)

    it.it.end(signal.SIGKILL)

    eventually_true(lambda: not left())


def test_the_log_says_whose_line_it_is(two, waits) -> None:
    """Two simulators print at the same time."""
    it = two(waits)

    it.start(FIRST)
    it.start(SECOND)
    it.it.request("/standby/stop", {"deadline_s": 0})

    assert {"a: up", "b: up", "palaestra-sidecar: a: starting"} <= set(it.it.lines)
    it.it.until_said("palaestra-sidecar: b: stopping: killed at its deadline")


def test_the_environment_of_a_simulator_has_its_slot(two) -> None:
    """A program that needs its own port can choose it by the slot."""
    it = two("import os; print('up', os.environ['PALAESTRA_SIMULATOR_SLOT'])")

    it.it.request("/start")
    it.it.request("/standby/start")

    it.it.until_said("a: up a")
    it.it.until_said("b: up b")


def test_the_metrics_tell_the_two_apart(two, waits) -> None:
    """A label separates them, which has only one value for a sidecar with one simulator."""
    it = two(waits)
    it.start(SECOND)

    _, text = it.it.ask("GET", "/metrics", address=it.it.health)

    values = dict(re.findall(r"^palaestra_simulator_(\S+) (\S+)$", text, re.MULTILINE))
    assert (values['starts_total{slot="a"}'], values['starts_total{slot="b"}']) == ("0.0", "1.0")
    assert values['state{slot="b",state="starting"}'] == "1.0"
    assert values['unexpected_exits_total{kind="code",slot="a"}'] == "0.0"
    assert float(values['rss_bytes{slot="b"}']) > 4e6


def test_the_health_port_shows_both_and_takes_no_orders(two, waits) -> None:
    """Users and the operator also see the standby."""
    it = two(waits)
    it.start(SECOND)

    assert it.state(SECOND, it.it.health) == it.state(SECOND)
    assert it.it.ask("POST", "/standby/stop", {"deadline_s": 0}, it.it.health)[0] == 404
    assert it.it.ask("GET", "/healthz", address=it.it.health) == (200, "ok\n")


def test_without_the_option_there_is_no_second_one(sidecar, waits) -> None:
    """A trainer that expects a standby gets an error at once."""
    status, text = sidecar(waits).ask("GET", "/standby/state")

    assert status == 404
    assert "/standby" not in json.loads(text)["error"]


def test_the_memory_of_a_simulator_is_reported_while_it_is_ready(sidecar, family) -> None:
    """The figure is the memory of all processes of the simulator.

    Before that, the state is read fifty times a second.
    """
    it = sidecar(family)
    before = it.start().rss_bytes

    it.request("/ready")

    assert before is None
    assert it.state.rss_bytes > 4 * 4e6  # room for four processes of Python
