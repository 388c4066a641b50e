"""The task MoveToTarget with the goal in the observation."""

from __future__ import annotations

import inspect
import itertools

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as check_env_for_sb3

from palaestra_trainer.environments import (
    GoalOptions,
    MoveToTargetEnv,
    MoveToTargetGoalEnv,
    MoveToTargetOptions,
)
from palaestra_trainer.environments.move_to_target import REACHED_M
from palaestra_trainer.environments.move_to_target_goal import FARTHEST_M
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.robots import Movement
from palaestra_trainer.simulators.entry_point import make_goal
from palaestra_trainer.testing import fake_arena

NAME = "MoveToTargetGoalEnv-v0"
SHEET = inspect.getdoc(MoveToTargetGoalEnv) or ""
VARIANTS = [
    {"actions": actions, "reward": reward}
    for actions, reward in itertools.product(("discrete", "continuous"), ("Dense", "Sparse"))
]
AHEAD = {"start": (-1.0, 0.0, 0.0), "target": (0.0, 0.0)}
STOP, FORWARD = Movement.STOP.value, Movement.FORWARD.value


@pytest.fixture
def make_env():
    """Return a function that makes the environment on a fake robot."""
    return lambda **options: MoveToTargetGoalEnv(*fake_arena(), GoalOptions(**options))


def drive(env, action, steps):
    """Take the same action for some steps, and return the result of the last one."""
    for _ in range(steps):
        result = env.step(action)
    return result


@pytest.mark.parametrize("options", VARIANTS, ids=lambda it: "-".join(it.values()))
@pytest.mark.parametrize("checker", [check_env, check_env_for_sb3], ids=["gymnasium", "sb3"])
def test_the_checkers_of_other_projects_have_nothing_to_object_to(checker, options):
    """Stable-Baselines3's checker also calls `compute_reward` with one pair of goals and with many pairs."""
    checker(make_goal(*fake_arena(), **options), skip_render_check=True)


def test_it_is_made_by_name():
    """After an import of the package, or with the package in the name, the environment is registered."""
    robot, scene = fake_arena()

    env = gymnasium.make(f"palaestra_trainer.environments:{NAME}", robot=robot, scene=scene, reward="Sparse")

    assert isinstance(env.unwrapped, MoveToTargetGoalEnv)
    assert env.unwrapped.options.reward == "Sparse"


@pytest.mark.parametrize("reward", ["Dense", "Sparse"])
def test_a_step_s_reward_is_that_of_its_goals(make_env, reward):
    """Hindsight replay computes rewards again, and the same goals must give the same reward."""
    env = make_env(reward=reward)
    env.reset(seed=3)

    for action in env.np_random.integers(0, 7, size=60):
        seen, paid, terminated, truncated, info = env.step(action)

        computed = env.compute_reward(seen["achieved_goal"], seen["desired_goal"], {})
        assert paid == float(computed) == info["reward_terms"]["reached"]
        assert terminated == env.compute_terminated(seen["achieved_goal"], seen["desired_goal"], info)
        if terminated or truncated:
            env.reset()


@pytest.mark.parametrize(
    ("reward", "near", "far"), [("Sparse", 1.0, 0.0), ("Dense", 1 - 0.19 / FARTHEST_M, 0.0)]
)
def test_rewards_are_in_the_ranges_on_the_sheet(make_env, reward, near, far):
    """As in hindsight experience replay, many goals are passed in one call."""
    achieved = np.array([[0.0, 0.0], [0.19, 0.0], [-2.0, -2.0]], np.float32)
    desired = np.array([[0.0, 0.0], [0.0, 0.0], [2.0, 2.0]], np.float32)

    rewards = make_env(reward=reward).compute_reward(achieved, desired, [{}] * 3)

    assert rewards.dtype == np.float32
    assert rewards == pytest.approx([1.0, near, far], abs=1e-6)


def test_arriving_ends_no_episode_and_staying_there_is_success(make_env):
    """The robot may leave the target again, so only the position at the last step counts."""
    env = make_env(max_steps=14, reward="Sparse")
    env.reset(seed=1, options=AHEAD)

    *_, early = drive(env, FORWARD, 10)
    seen, reward, terminated, truncated, info = drive(env, STOP, 4)

    assert early["outcome"] == "running"
    assert np.linalg.norm(seen["achieved_goal"] - seen["desired_goal"]) < REACHED_M
    assert (reward, terminated, truncated) == (1.0, False, True)
    assert (info["is_success"], info["outcome"]) == (True, "reached")


def test_time_that_is_up_far_from_the_target_is_no_success(make_env):
    """The world could continue, so the episode is truncated."""
    env = make_env(max_steps=3)
    env.reset(seed=1, options=AHEAD)

    *_, terminated, truncated, info = drive(env, STOP, 3)

    assert (terminated, truncated) == (False, True)
    assert (info["is_success"], info["outcome"]) == (False, "time_up")


def test_a_collision_ends_the_episode(make_env):
    """No more reward follows a collision, so a collision is worse than continuing."""
    env = make_env()
    env.reset(seed=1, options={"start": (-1.7, 0.0, 3.14159), "target": (0.0, 0.0)})

    for _ in range(9):
        *_, terminated, _, info = env.step(FORWARD)
        if terminated:
            break

    assert (terminated, info["outcome"], info["is_success"]) == (True, "collided", False)


def test_the_same_seed_is_the_same_episode_as_in_the_task_without_goals(make_env):
    """Policies of both tasks can be compared on the same episodes."""
    plain = MoveToTargetEnv(*fake_arena(), MoveToTargetOptions(observe=GoalOptions().observe))
    env = make_env()

    numbers, info = plain.reset(seed=5)
    seen, goal_info = env.reset(seed=5)

    assert seen["observation"].tolist() == numbers.tolist()
    assert goal_info == info
    assert seen["desired_goal"] == pytest.approx(info["target"])


@pytest.mark.parametrize(
    ("options", "fact"),
    [
        ({"observe": ["target"]}, "observe: the policy must see the target only as"),
        ({"reward": "Sparce"}, "reward: 'Sparce' is not a reward"),
        ({"frames": 3}, "frames: is not an option; use "),
    ],
)
def test_wrong_options_are_refused(options, fact):
    """The rules are those of the task without goals; in addition, the goal must not be observed twice."""
    with pytest.raises(ConfigurationError, match=fact):
        make_goal(*fake_arena(), **options)


def test_the_sheet_has_every_key_with_its_bounds(make_env):
    """A user reads the keys and bounds from the docstring, which must agree with the space."""
    space = make_env().observation_space
    rows = [
        line.split("|")[1:-1]
        for line in SHEET.splitlines()
        if line.startswith(("| observation ", "| achieved_goal ", "| desired_goal "))
    ]
    sheet = {key.strip(): (low.strip(), high.strip(), index.strip()) for key, index, _, _, low, high in rows}

    assert sheet.keys() == space.spaces.keys()
    assert sheet["observation"][2] == f"0-{space['observation'].shape[0] - 1}"
    for key in ("achieved_goal", "desired_goal"):
        assert (space[key].low == float(sheet[key][0])).all()
        assert (space[key].high == float(sheet[key][1])).all()
    assert f"{REACHED_M:.2f} m" in SHEET
    assert f"{FARTHEST_M:.2f} m" in SHEET
