"""Two independent simulators in one sidecar, so that one can start while the other works."""

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
    """A sidecar with two simulators; the prefix of the request paths selects one of them."""

    def __init__(self, sidecar, eventually) -> None:
        self.it = sidecar
        self._eventually = eventually

    def state(self, above, address=None):
        """Return the state that the sidecar reports for one simulator."""
        status, text = self.it.ask("GET", f"{above}/state", address=address)
        assert status == 200, text
        return SimulatorState.from_json(json.loads(text))

    def start(self, above):
        """Start one simulator, and return its state.

        The method waits until the simulator has printed `up` and the sidecar has noticed that it runs.
        """
        line = {FIRST: "a: up", SECOND: "b: up"}[above]
        ups = self.it.lines.count(line) + 1
        self.it.request(f"{above}/start")
        self._eventually(lambda: self.it.lines.count(line) >= ups and was_seen(self.state(above)))
        return self.state(above)

    def until(self, above, wanted):
        """Wait until one simulator is in the state `wanted`, and return the full state."""
        self._eventually(lambda: self.state(above).state is wanted)
        return self.state(above)


@pytest.fixture
def two(sidecar, tmp_path, eventually_true):
    """Return a function that starts a sidecar whose two simulators are the same program."""

    def run(program):
        given = (f"--work={tmp_path}/work", "--job=j", "--uid=u", "--clock", "--standby")
        return Two(sidecar(program, *given), eventually_true)

    return run


def test_each_has_a_world_with_names_of_its_own(two, waits) -> None:
    """The name for slot b has another readable part and another hash.

    With equal names, each simulator would remove the other from the ROS master.
    """
    it = two(waits)

    for above, slot, file in ((FIRST, "a", "collect-0.wbt"), (SECOND, "b", "collect-0b.wbt")):
        identity = RunIdentity(job="j", uid="u", replica=0, group="collect", index=0, slot=slot)
        state = it.state(above)
        (robot,) = robots(Path(state.world).read_bytes())
        assert Path(state.world).name == file
        assert state.robots[0].ros_name == robot.ros_name == ros_name(identity, "robotino")


def test_the_one_that_stands_by_keeps_no_clock(two, waits) -> None:
    """Only one simulator per ROS master may publish /clock, even while both run."""
    it = two(waits)

    assert b"--clock" in Path(it.state(FIRST).world).read_bytes()
    assert b"--clock" not in Path(it.state(SECOND).world).read_bytes()


def test_each_is_started_and_stopped_by_itself(two, waits) -> None:
    """The trainer decides which simulator is in use, so the sidecar treats both in the same way."""
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
    """A crash of one simulator must not change the state and the counts of the other."""
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
    """The sidecar inherits the processes of one simulator, and must not end the other one's reaper."""
    it = two(family)
    sidecar = it.it.process.pid
    it.start(FIRST)
    (reaper,) = children({sidecar})
    it.start(SECOND)

    os.kill(reaper, signal.SIGKILL)
    it.until(FIRST, FAILED)

    eventually_true(lambda: len(left()) == 6)  # sidecar; reaper, simulator and three children
    assert it.state(SECOND).state is STARTING
    assert len(children({sidecar})) == 1


@pytest.mark.parametrize("what", ["waits", "stubborn", "family"])
def test_a_signal_ends_both(two, request, left, eventually_true, what) -> None:
    """At the end of the pod, two simulators must end within the time that a single one has."""
    it = two(request.getfixturevalue(what))
    it.start(FIRST)
    it.start(SECOND)

    assert it.it.end() in ENDS
    eventually_true(lambda: not left())


def test_a_killed_sidecar_leaves_neither(two, family, left, eventually_true) -> None:
    """The reaper of each simulator notices the end of its own pipe."""
    it = two(family)
    it.start(FIRST)
    it.start(SECOND)

    it.it.end(signal.SIGKILL)

    eventually_true(lambda: not left())


def test_the_log_says_whose_line_it_is(two, waits) -> None:
    """Both simulators print at the same time, so each line needs the slot of its simulator."""
    it = two(waits)

    it.start(FIRST)
    it.start(SECOND)
    it.it.request("/standby/stop", {"deadline_s": 0})

    assert {"a: up", "b: up", "palaestra-sidecar: a: starting"} <= set(it.it.lines)
    it.it.until_said("palaestra-sidecar: b: stopping: killed at its deadline")


def test_the_environment_of_a_simulator_has_its_slot(two) -> None:
    """A program that needs a port of its own can choose the port by the slot."""
    it = two("import os; print('up', os.environ['PALAESTRA_SIMULATOR_SLOT'])")

    it.it.request("/start")
    it.it.request("/standby/start")

    it.it.until_said("a: up a")
    it.it.until_said("b: up b")


def test_the_metrics_tell_the_two_apart(two, waits) -> None:
    """A label names the simulator.

    A sidecar with one simulator has the same label, so one query fits both.
    """
    it = two(waits)
    it.start(SECOND)

    _, text = it.it.ask("GET", "/metrics", address=it.it.health)

    values = dict(re.findall(r"^palaestra_simulator_(\S+) (\S+)$", text, re.MULTILINE))
    assert (values['starts_total{slot="a"}'], values['starts_total{slot="b"}']) == ("0.0", "1.0")
    assert values['state{slot="b",state="starting"}'] == "1.0"
    assert values['unexpected_exits_total{kind="code",slot="a"}'] == "0.0"
    assert float(values['rss_bytes{slot="b"}']) > 4e6


def test_the_health_port_shows_both_and_takes_no_orders(two, waits) -> None:
    """Users and the operator must be able to see the standby, but not to control it."""
    it = two(waits)
    it.start(SECOND)

    assert it.state(SECOND, it.it.health) == it.state(SECOND)
    assert it.it.ask("POST", "/standby/stop", {"deadline_s": 0}, it.it.health)[0] == 404
    assert it.it.ask("GET", "/healthz", address=it.it.health) == (200, "ok\n")


def test_without_the_option_there_is_no_second_one(sidecar, waits) -> None:
    """A trainer that expects a standby must get an error at once."""
    status, text = sidecar(waits).ask("GET", "/standby/state")

    assert status == 404
    assert "/standby" not in json.loads(text)["error"]


def test_the_memory_of_a_simulator_is_reported_while_it_is_ready(sidecar, family) -> None:
    """The trainer needs the memory of all processes of the simulator to decide about recycling.

    During a start, the trainer reads the state fifty times per second, so the figure is left out.
    """
    it = sidecar(family)
    before = it.start().rss_bytes

    it.request("/ready")

    assert before is None
    assert it.state.rss_bytes > 4 * 4e6  # more than four Python processes need at least
