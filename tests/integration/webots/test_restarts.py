"""A program can continue after a restart of its simulator without further calls."""

import os
import signal

import gymnasium
import pytest

import palaestra_trainer.environments  # noqa: F401 - registers the environment
from palaestra_trainer.robots.robotino import Robotino
from palaestra_trainer.robots.simulated import SimulatedScene
from palaestra_trainer.webots import Webots

STANDS = 0


def environment(robot, scene):
    """Return the environment with this robot and this scene."""
    return gymnasium.make("MoveToTargetEnv-v0", robot=robot, scene=scene)


def test_an_episode_can_be_begun_after_each_restart(own_arena):
    """The paper's loop restarts its simulator before the 25th reset, in which it always crashed."""
    env = environment(own_arena.robot, own_arena.scene)

    began = [own_arena.webots.run(lambda: env.reset(seed=1), restart=True)[0].tolist() for _ in range(2)]

    assert began[0] == began[1]
    assert own_arena.launcher.state().starts == 3


def test_a_robot_that_was_made_before_the_simulator_needs_no_connect(master):
    """In listings 3 and 4 of the paper, the first reset starts Webots and connects the robot."""
    del master
    webots = Webots("robotino", "arena")
    robot = Robotino(webots)
    env = environment(robot, SimulatedScene(webots, robot))

    webots.run(lambda: env.reset(seed=1))
    collected = webots.run(lambda: [env.step(STANDS) for _ in range(3)])
    with webots:
        env.reset(seed=2)
        evaluated = env.step(STANDS)

    robot.close()
    webots.stop()
    webots.close()
    assert [step[4]["outcome"] for step in (*collected, evaluated)] == ["running"] * 4


def test_the_newest_robot_of_a_name_is_connected_and_no_other(own_arena):
    """A repeated cell of a notebook creates a second robot, and the first may have been a mistake."""
    Robotino(own_arena.webots, period_ms=50)  # a period that the simulator refuses
    robot = Robotino(own_arena.webots)

    own_arena.webots()

    with own_arena.webots:
        assert robot.advance() == 0
    robot.close()


@pytest.mark.parametrize("begin", [Webots.start, Webots.__enter__])
def test_a_hung_simulator_is_restarted_when_it_is_to_be_started(own_arena, begin):
    """The sidecar still reports the hung simulator as ready, and would refuse a second start."""
    hung = own_arena.pid
    os.kill(hung, signal.SIGSTOP)

    begin(own_arena.webots)

    assert own_arena.webots.available()
    assert own_arena.pid != hung


def test_a_simulator_that_is_on_its_way_is_not_restarted(own_arena):
    """A simulator that is starting does not respond either, but needs only more time."""
    own_arena.webots.stop()
    own_arena.launcher.start()

    own_arena.webots.start()

    assert own_arena.launcher.state().starts == 2
