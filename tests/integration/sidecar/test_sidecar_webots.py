"""The driver webots, with a program that looks for controllers in the same folders as Webots."""

import os
import sys
from pathlib import Path

import pytest

from palaestra_protocol.control import SidecarState
from palaestra_sim.world import RunIdentity, robots, ros_name
from tests.fake_webots.home import make_home
from tests.integration.sidecar.conftest import PROGRAM

WORLD = """#VRML_SIM R2023b utf8
Robot { name "robotino" controller "ros" supervisor TRUE }
Robot { name "ball" controller "roll" }
"""
# Webots looks in controllers/<name> next to the world's folder, and otherwise uses <generic>.
# Source: WbRobot.cpp, updateControllerDir.
WEBOTS = f"""#!{os.path.realpath(sys.executable)} -ISu
import pathlib, signal, sys
world = next(pathlib.Path(option) for option in sys.argv if option.endswith(".wbt"))
roll = world.parent.parent / "controllers" / "roll" / "roll.py"
print("started", roll.read_text() if roll.parent.is_dir() else "<generic>", "in", world.name)
print("up")
signal.pause()
"""


@pytest.fixture
def webots(run_sidecar, tmp_path):
    """Return a function that starts a sidecar with driver webots and the world `source/worlds/arena.wbt`."""
    program = tmp_path / "bin" / "webots"
    program.parent.mkdir()
    program.write_text(WEBOTS)
    program.chmod(0o755)
    world = tmp_path / "source" / "worlds" / "arena.wbt"
    world.parent.mkdir(parents=True)
    world.write_text(WORLD)

    def run(*options):
        return run_sidecar(
            [
                *("env", "-u", "WEBOTS_EXTRA_PROJECT_PATH", "-u", "WEBOTS_HOME", f"PATH={program.parent}"),
                *(PROGRAM, "--driver=webots", f"--world={world}", f"--work={tmp_path}/work"),
                *("--control=127.0.0.1:0", "--health=127.0.0.1:0", *options),
            ]
        )

    return run


@pytest.fixture
def roll(tmp_path):
    """Write the controller `roll` into the Webots project of the world."""
    path = tmp_path / "source" / "controllers" / "roll" / "roll.py"
    path.parent.mkdir(parents=True)
    path.write_text("roll.py")


@pytest.mark.usefixtures("roll")
def test_webots_finds_the_controllers_of_the_project(webots) -> None:
    """The controllers must be found again after a restart of the simulator or of the container."""
    it = webots("--job=j")
    it.start()
    it.request("/stop", {"deadline_s": 0})
    it.until(SidecarState.IDLE)
    it.start()
    it.end()
    again = webots("--job=j")

    again.start()

    line = "started roll.py in collect-0.wbt"
    assert (it.lines.count(line), again.lines.count(line)) == (2, 1)
    assert not any("not in a Webots project" in line for line in it.lines + again.lines)


@pytest.mark.usefixtures("roll")
def test_webots_finds_them_for_a_standby_as_well(webots) -> None:
    """The worlds of both simulators are in one copy of the project."""
    it = webots("--job=j", "--standby")

    it.request("/start")
    it.request("/standby/start")

    it.until_said("a: started roll.py in collect-0.wbt")
    it.until_said("b: started roll.py in collect-0b.wbt")


def test_a_controller_without_a_project_is_named_once(webots) -> None:
    """The user gets one warning after the line with the addresses, which programs read first.

    Webots itself would warn at every start, or not at all.
    """
    it = webots("--job=j", "--standby")
    it.request("/start")
    it.until_said("a: started <generic> in collect-0.wbt")

    [warning] = [line for line in it.lines if "not in a Webots project" in line]
    assert warning.startswith("palaestra-sidecar: warning: --world: ")
    assert '"ball" (controller "roll"); put the project into' in warning


def test_a_world_for_ros_gets_the_name_and_the_option_that_it_lacks(webots) -> None:
    """Most worlds for the ros controller have neither a ROS name nor `--synchronize`."""
    it = webots("--job=j", "--uid=u")

    state = it.state
    [robot] = robots(Path(state.world).read_bytes())
    name = ros_name(RunIdentity(job="j", uid="u", replica=0, group="collect", index=0), "robotino")
    assert (robot.ros_name, robot.synchronize) == (name, True)
    assert [found.ros_name for found in state.robots] == [name]


@pytest.mark.parametrize(
    ("choice", "line"),
    [
        ("palaestra", "ros: no ROS master at"),
        ("webots", "the controller of Webots was started"),
    ],
)
def test_the_controller_of_webots_is_replaced_unless_a_variable_keeps_it(run_sidecar, tmp_path, choice, line):
    """Webots R2023b has a controller of that name, and prefers a program to a script."""
    home = make_home(tmp_path, "R2023b")
    it = run_sidecar(
        [
            *("env", f"WEBOTS_HOME={home}", f"PATH={home}:{os.environ['PATH']}"),
            *("ROS_MASTER_URI=http://127.0.0.1:9", f"WEBOTS_ROS_CONTROLLER={choice}", PROGRAM),
            *("--driver=webots", "--world=arena", f"--work={tmp_path}/work", "--job=j"),
            *("--control=127.0.0.1:0", "--health=127.0.0.1:0"),
        ]
    )

    it.request("/start")

    it.until_said(line)
