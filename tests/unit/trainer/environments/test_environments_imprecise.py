"""The example imprecise.py: errors of a real robot in a simulation, and none on a real robot."""

import importlib.util
import math
from pathlib import Path

import pytest

from palaestra_trainer.robots import Movement
from palaestra_trainer.testing import fake_arena

EXAMPLE = Path(__file__).parents[4] / "examples" / "imprecise.py"
TASK = {"start": (-1.5, 0.0, 0.0), "target": (1.5, 0.0)}


@pytest.fixture(scope="module")
def example():
    """Return the module of the example."""
    spec = importlib.util.spec_from_file_location("imprecise", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def drives(env, robot, seed, steps=12):
    """Drive forward; return for each step the observed pose and the true one."""
    env.reset(seed=seed, options=TASK)
    poses = []
    for _ in range(steps):
        env.step(Movement.FORWARD)
        poses.append((env.situation.pose, robot.pose()))
    return poses


def error_m(poses):
    """Return the distance between odometry and truth after the last step."""
    seen, true = poses[-1]
    return math.dist((seen.x_m, seen.y_m), (true.x_m, true.y_m))


def test_odometry_drifts_differently_in_every_episode_and_equally_for_a_seed(example):
    """A policy must not learn one error by heart, and an interrupted run must resume exactly."""
    robot, scene = fake_arena()
    env = example.make(robot, scene)

    first, other, again = (drives(env, robot, seed) for seed in (1, 2, 1))

    assert first == again
    assert first != other
    assert 0.0 < error_m(first) < 0.1


def test_odometry_begins_without_an_error(example):
    """A person places a real robot, and says where it stands."""
    robot, scene = fake_arena()
    env = example.make(robot, scene)
    env.reset(seed=3, options=TASK)

    assert env.situation.pose == robot.pose()


def test_a_real_robot_is_not_disturbed(example):
    """It has errors of its own, and a command that is lost on purpose could be the one that avoids a wall."""
    robot, scene = fake_arena()
    robot.real = True

    env = example.make(robot, scene)

    assert error_m(drives(env, robot, 1)) == 0.0
    assert env.reached_m == 0.10
