"""An environment in which the robot visits three targets in turn, in a world with one target marker."""

from __future__ import annotations

import math
from itertools import pairwise

import gymnasium
import pytest
from gymnasium.utils.env_checker import check_env

from palaestra_trainer.environments import DeliverEnv
from palaestra_trainer.environments.baselines import straight_to_target
from palaestra_trainer.environments.placement import APART_M
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.simulators.entry_point import make_delivering
from palaestra_trainer.testing import FakeScene, fake_arena
from palaestra_trainer.testing.fake_robotino import FakeRobotino
from palaestra_trainer.testing.fake_scene import arena


@pytest.fixture
def empty():
    """Return an environment without cylinders, and its scene.

    There the robot delivers by driving straight.
    """
    robot = FakeRobotino()
    scene = FakeScene(robot, arena(()))
    return make_delivering(robot, scene), scene


def play(env, seed):
    """Drive straight from target to target, and return the results of the episode's steps."""
    env.reset(seed=seed)
    rows = []
    while not rows or not (rows[-1][2] or rows[-1][3]):
        rows.append(env.step(straight_to_target(env)))
    return rows


def test_gymnasium_has_nothing_to_object_to():
    """Gymnasium's checker tests seeds, spaces, types and determinism."""
    check_env(make_delivering(*fake_arena()), skip_render_check=True)


def test_the_environment_is_made_by_name():
    """After an import of the package, the environment is registered with gymnasium."""
    env = gymnasium.make("Deliver-v0", simulator=fake_arena, targets=2)

    assert isinstance(env.unwrapped, DeliverEnv)


def test_three_targets_are_delivered_before_the_episode_ends(empty):
    """Each delivery is rewarded, but only the last one is a success."""
    env, _ = empty

    rows = play(env, seed=4)
    outcomes = [info["outcome"] for *_, info in rows if info["outcome"] != "running"]

    assert outcomes == ["delivered", "delivered", "reached"]
    assert [info["is_success"] for *_, info in rows].count(True) == 1
    assert sum(info["reward_terms"]["success"] for *_, info in rows) == 3.0


def test_the_mark_moves_to_a_target_far_from_the_last(empty):
    """If the next target were near, the robot would reach it without driving."""
    env, scene = empty
    env.reset(seed=4)
    marks, over = [scene.target], False

    while not over:
        _, _, over, _, _ = env.step(straight_to_target(env))
        if scene.target != marks[-1]:
            marks.append(scene.target)

    assert len(marks) == 3
    assert all(math.dist(one, other) >= APART_M for one, other in pairwise(marks))


def test_what_is_left_is_observed(empty):
    """The policy must see how many targets are left.

    The last number of the observation is their share: 1, 2/3 or 1/3.
    """
    env, _ = empty

    left = [round(float(row[0][-1]), 3) for row in play(env, seed=4)]

    assert sorted(set(left), reverse=True) == [1.0, 0.667, 0.333]
    assert left == sorted(left, reverse=True)


def test_the_observation_after_a_delivery_shows_the_next_target(empty):
    """After a delivery the robot still stands on the old target, which would be 0 m away."""
    env, _ = empty
    env.reset(seed=4)

    while True:
        *_, info = env.step(straight_to_target(env))
        if info["outcome"] == "delivered":
            break

    assert env.situation.target_distance_m > 0.7


def test_no_targets_are_refused():
    """An episode without targets could not end in success."""
    with pytest.raises(ConfigurationError, match="targets: 0 are too few"):
        make_delivering(*fake_arena(), targets=0)
