"""If a world lacks a part that the environment needs, the error comes before the first step."""

import threading
from contextlib import nullcontext

import gymnasium
import pytest

import palaestra_trainer.environments  # noqa: F401 - registers the environment
from palaestra_sim.ros import Loop, RosNode
from palaestra_sim.world import builtin
from palaestra_trainer.errors import ConfigurationError, WorldMisfit
from palaestra_trainer.robots.robotino import Robotino
from palaestra_trainer.robots.simulated import SimulatedScene
from palaestra_trainer.simulators.restarter import Restarter, await_one
from palaestra_trainer.simulators.simulator import Simulator
from palaestra_trainer.webots import Webots
from palaestra_trainer.webots.device_check import require_devices
from palaestra_trainer.webots.launching.local_simulator import ProcessLauncher

DEADLINE_S = 60.0
ARENA = builtin("arena")
WITHOUT = {
    "a sensor": (
        ARENA.replace(b'"ir3"', b'"sonar"'),
        "the robot has no device ir3; it has wheel0_joint, .*, ir2, sonar, ir4",
    ),
    "the robot's node": (ARENA.replace(b"DEF ROBOTINO", b"DEF ROBOT"), "the world has no node DEF ROBOTINO"),
    "the mark": (ARENA.replace(b"DEF TARGET", b"DEF GOAL"), "the world has no node DEF TARGET"),
}


@pytest.fixture
def world(tmp_path):
    """Return a function that writes a world file and returns its path."""

    def write(source):
        path = tmp_path / "changed.wbt"
        path.write_bytes(source)
        return path

    return write


@pytest.mark.parametrize(("source", "fact"), WITHOUT.values(), ids=WITHOUT.keys())
def test_a_start_names_what_the_world_lacks(master, world, source, fact):
    """The user must learn the name of the missing part before training starts."""
    del master
    assert source != ARENA
    webots = Webots("robotino", world(source), start_deadline_s=DEADLINE_S)
    robot = Robotino(webots)
    SimulatedScene(webots, robot)
    try:
        with pytest.raises(WorldMisfit, match=fact):
            webots.start()
    finally:
        robot.close()
        webots.stop()
        webots.close()


def test_the_second_process_in_a_row_makes_a_wrong_configuration_of_it(master, world):
    """The world does not change, so restarts must not spend the budget of ten."""
    del master
    source, fact = WITHOUT["a sensor"]

    def make(robot, scene):
        return gymnasium.make("MoveToTargetEnv-v0", disable_env_checker=True, robot=robot, scene=scene)

    launcher = ProcessLauncher(world(source))
    simulator = Simulator("collect-0", launcher, make, DEADLINE_S)
    restarter = Restarter(simulator)
    pids = []
    start = simulator.start

    def start_and_count():
        try:
            start()
        finally:
            pids.append(launcher.state().pid)

    simulator.start = start_and_count
    try:
        restarter.begin_start()
        await_one([restarter])

        with pytest.raises(ConfigurationError, match=f"collect-0: robotino: {fact}"):
            restarter.up()

        assert len(set(pids)) == 2
    finally:
        restarter.stop()
        launcher.close()


@pytest.mark.parametrize("count", [1, 2])
def test_only_a_complete_list_of_devices_is_a_proof(master, count):
    """A simulator that is still starting may report only some of its devices."""
    loop = Loop()
    node = RosNode(loop, "half_started", master)
    node.serve("robot/get_device_list", "webots_ros/robot_get_device_list", lambda _: {"list": ["ir2"]})
    node.serve("robot/get_number_of_devices", "webots_ros/get_int", lambda _: {"value": count})
    thread = threading.Thread(target=loop.run, daemon=True)
    thread.start()
    try:
        with pytest.raises(WorldMisfit) if count == 1 else nullcontext():
            require_devices("half_started", ["ir1"])
    finally:
        loop.post(node.close)
        loop.post(loop.stop)
        thread.join(DEADLINE_S)
        loop.close()


def test_a_world_without_a_supervisor_is_a_wrong_configuration(master, world):
    """Every process of this world would have the same error, so a restart cannot help."""
    del master
    launcher = ProcessLauncher(world(ARENA.replace(b"supervisor TRUE", b"supervisor FALSE")))
    try:
        with pytest.raises(
            ConfigurationError, match="collect-0: the world has no robot with supervisor TRUE"
        ):
            Simulator("collect-0", launcher, lambda _robot, _scene: None, DEADLINE_S)
    finally:
        launcher.close()
