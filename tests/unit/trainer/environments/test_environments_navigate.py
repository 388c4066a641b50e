"""The task Navigate for two wheels and a laser scanner, and its fake robot."""

from __future__ import annotations

import inspect
import itertools
import math

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env
from hypothesis import given
from hypothesis import strategies as st
from stable_baselines3.common.env_checker import check_env as check_env_for_sb3

from palaestra_trainer.environments import NavigateEnv
from palaestra_trainer.environments.navigate import BUMPED_M, MOVES, SECTORS
from palaestra_trainer.errors import ConfigurationError, MissingCapability, SimulatorDead
from palaestra_trainer.robots import Pose
from palaestra_trainer.simulators.entry_point import make_navigating
from palaestra_trainer.testing import check_robot, check_scene, fake_arena, fake_court
from palaestra_trainer.testing.fake_burger import RAYS

NAME = "Navigate-v0"
VARIANTS = list(itertools.product(("discrete", "continuous"), ("Dense", "Sparse")))
TO_THE_TARGET = {"start": (-0.2, 0.0, 0.0), "target": (0.4, 0.0)}


@pytest.fixture
def make_env():
    """Make an environment on a fake robot.

    The robot dies at the steps `deaths`; other keywords are options.
    """

    def with_options(deaths=(), **options):
        return make_navigating(*fake_court(deaths), **options)

    return with_options


@pytest.mark.parametrize(("actions", "reward"), VARIANTS)
def test_nobody_has_anything_to_object_to(make_env, actions, reward):
    """The checkers of gymnasium and Stable-Baselines3 test seeds, spaces, types and determinism."""
    check_env(make_env(actions=actions, reward=reward), skip_render_check=True)
    check_env_for_sb3(make_env(actions=actions, reward=reward), skip_render_check=True)


def test_the_environment_is_made_by_name():
    """After an import of the package, the environment is registered with gymnasium."""
    env = gymnasium.make(NAME, simulator=fake_court, max_steps=7)

    assert isinstance(env.unwrapped, NavigateEnv)
    assert env.unwrapped.options.max_steps == 7


def test_driving_straight_on_reaches_a_target_ahead(make_env):
    """The robot drives 0.45 m at 0.198 m/s, in steps of 0.192 s."""
    env = make_env()
    env.reset(seed=1, options=TO_THE_TARGET)

    running = [env.step(0)[4]["outcome"] for _ in range(11)]
    _, reward, terminated, _, info = env.step(0)

    assert running == ["running"] * 11
    assert (info["outcome"], info["is_success"], terminated) == ("reached", True, True)
    assert reward == pytest.approx(sum(info["reward_terms"].values()))
    assert info["reward_terms"]["success"] == 1.0


def test_a_wall_ends_the_episode_before_the_scanner_goes_blind(make_env):
    """Below 0.12 m, this type of scanner measures nothing."""
    env = make_env()
    env.reset(seed=1, options={"start": (1.0, 0.0, 0.0), "target": (-1.0, 0.0)})

    outcomes = [env.step(0)[4]["outcome"] for _ in range(12)]

    assert "collided" in outcomes


def test_time_up_truncates(make_env):
    """The world could continue after the time limit."""
    env = make_env(max_steps=2)
    env.reset(seed=1)

    assert [env.step(3)[2:4] for _ in range(2)] == [(False, False), (False, True)]


def test_the_target_is_given_by_distance_and_bearing(make_env):
    """An angle would jump at pi, so the bearing is a cosine and a sine: 0 and 1 for a target on the left."""
    env = make_env()

    seen, _ = env.reset(seed=1, options={"start": (0.0, -0.1, 0.0), "target": (0.0, 0.9)})

    assert seen[SECTORS + 2 : SECTORS + 5] == pytest.approx([0.5, 0.0, 1.0], abs=1e-6)


def test_a_thing_on_the_left_is_in_a_sector_on_the_left(make_env):
    """The first sectors look behind and to the right, the last sectors look left and behind."""
    env = make_env()

    seen, _ = env.reset(seed=1, options={"start": (0.0, 1.2, 0.0), "target": (0.0, 0.0)})

    assert np.argmax(seen[:SECTORS]) in (SECTORS * 3 // 4 - 1, SECTORS * 3 // 4)


def test_without_an_episode_there_is_no_step(make_env):
    """Gymnasium requires a reset before the first step."""
    with pytest.raises(ResetNeeded):
        make_env().step(0)


def test_a_fault_passes(make_env):
    """The caller of the environment decides what a fault means."""
    env = make_env(deaths=(1,))
    env.reset(seed=1)

    with pytest.raises(SimulatorDead):
        env.step(0)


def test_a_robot_without_a_scanner_is_refused():
    """The error comes before the first step, and lists the devices that the robot has."""
    with pytest.raises(MissingCapability, match="FakeRobotino has no Scanner, which NavigateEnv needs"):
        make_navigating(*fake_arena())


@pytest.mark.parametrize("options", [{"actions": "both"}, {"max_steps": 0}, {"movements": ["STOP"]}])
def test_wrong_options_are_refused(make_env, options):
    """The message names the option, because a job may have several options."""
    with pytest.raises(ConfigurationError, match=next(iter(options))):
        make_env(**options)


def test_the_data_sheet_has_the_actions():
    """A user reads the velocities of each action from the docstring."""
    rows = [line.split("|") for line in (inspect.getdoc(NavigateEnv) or "").splitlines() if "|" in line]
    actions = [(float(row[3]), float(row[4])) for row in rows if len(row) == 6 and row[1].strip().isdigit()]

    assert actions == list(MOVES)


def test_the_fake_is_a_robot_with_a_scene():
    """The fake passes the checks that users run on their own robots."""
    robot, scene = fake_court()

    check_robot(robot)
    check_scene(robot, scene, Pose(0.0, 0.0, 1.0), (1.0, 0.0))


def test_a_wheel_that_would_run_too_fast_slows_both():
    """The ratio of both speeds stays, so the robot drives the same curve."""
    fast, slow = fake_court()[0], fake_court()[0]

    fast.steer(0.44, 1.0)
    slow.steer(0.22 * 0.22 / 0.26, 0.22 * 0.5 / 0.26)
    fast.advance()
    slow.advance()

    assert math.hypot(fast.pose().x_m, fast.pose().y_m) < 0.22 * fast.period_s
    assert fast.pose().heading_rad / fast.pose().x_m == pytest.approx(1.0 / 0.44, rel=0.01)


@given(
    seed=st.integers(0, 2**31 - 1),
    moves=st.lists(st.sampled_from(MOVES), min_size=1, max_size=60),
    heading_rad=st.floats(-math.pi, math.pi, exclude_min=True),
)
def test_the_fake_never_drives_into_a_thing(seed, moves, heading_rad):
    """A policy must not learn from poses that no real robot can have.

    The distances of the scanner stay in range as well.
    """
    robot, scene = fake_court()
    robot.use_scanner()
    scene.reset(seed, Pose(0.0, 0.0, heading_rad), (1.0, 0.0))

    for forward, turn in moves:
        robot.steer(forward * robot.speed_m_s, turn * robot.turn_rad_s)
        robot.advance()

        assert scene.layout().gap(robot.pose().x_m, robot.pose().y_m) > robot.radius_m - 0.01
        assert robot.scan().shape == (RAYS,)
        assert robot.scan().min() >= np.float32(robot.scan_range_m[0])
        assert robot.scan().max() <= np.float32(robot.scan_range_m[1])


def test_what_is_too_near_is_not_seen():
    """The real scanner has the same limit; the episode ends at a larger distance."""
    robot, scene = fake_court()
    robot.use_scanner()
    scene.reset(1, Pose(1.35, 0.0, 0.0), (0.0, 0.0))

    near = robot.scan()[RAYS // 2]
    scene.reset(1, Pose(1.44, 0.0, 0.0), (0.0, 0.0))

    assert near < robot.radius_m + BUMPED_M + 0.06
    assert robot.scan()[RAYS // 2] > 3.0
