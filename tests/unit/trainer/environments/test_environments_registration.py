"""The ways to make an environment, and other projects' checkers of environments."""

from __future__ import annotations

import itertools
import subprocess
import sys
import textwrap
import threading

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as check_env_for_sb3

import palaestra_trainer.environments
from palaestra_trainer.environments import MoveToTargetEnv
from palaestra_trainer.environments.observation import PARTS
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.robots import Movement
from palaestra_trainer.simulators.entry_point import make
from palaestra_trainer.testing import FakeRobotino, FakeScene, fake_arena

NAME = "MoveToTargetEnv-v0"
VARIANTS = [
    {"actions": actions, "reward": reward, "observe": observe}
    for actions, reward, observe in itertools.product(
        ("discrete", "continuous"), ("Dense", "Sparse"), (tuple(PARTS), ("target",))
    )
]


@pytest.mark.parametrize("options", VARIANTS, ids=lambda it: "-".join(map(str, it.values())))
def test_gymnasium_has_nothing_to_object_to(options):
    """The checker tests seeds, spaces, types and determinism; each warning is an error here."""
    check_env(make(*fake_arena(), **options), skip_render_check=True)


@pytest.mark.parametrize("options", VARIANTS, ids=lambda it: "-".join(map(str, it.values())))
def test_stable_baselines3_has_nothing_to_object_to(options):
    """The checker of Stable-Baselines3 has additional rules for learning."""
    check_env_for_sb3(make(*fake_arena(), **options), skip_render_check=True)


@pytest.mark.parametrize("name", [NAME, f"palaestra_trainer.environments:{NAME}"])
def test_the_environment_is_made_by_name(name):
    """An import of the package registers the environment; gymnasium imports the package in a name."""
    robot, scene = fake_arena()

    env = gymnasium.make(name, robot=robot, scene=scene, movements=["STOP", "LEFT"], max_steps=7)

    assert isinstance(env.unwrapped, MoveToTargetEnv)
    assert env.unwrapped.options.movements == (Movement.STOP, Movement.LEFT)
    assert env.unwrapped.options.max_steps == 7


def test_gymnasium_adds_no_time_limit_of_its_own():
    """The environment ends an episode at its time limit itself, because Sparse rewards the last step."""
    spec = gymnasium.spec(NAME)

    assert spec.max_episode_steps is None
    assert spec.id in gymnasium.registry
    assert palaestra_trainer.environments.MoveToTargetEnv is MoveToTargetEnv


def test_a_robot_that_cannot_be_copied_can_be_used():
    """Gymnasium copies the arguments of `make`, but a robot's sockets and threads cannot be copied."""
    robot, scene = fake_arena()
    robot.socket = threading.Lock()

    env = gymnasium.make(NAME, robot=robot, scene=scene)
    observation, _ = env.reset(seed=1)
    env.step(env.action_space.sample())

    assert env.observation_space.contains(observation)


@pytest.mark.parametrize("mode", ["sync", "async"])
def test_many_are_made_at_once_each_with_a_simulator_of_its_own(mode):
    """Two environments of one simulator would move the same robot, so each gets its own simulator."""
    envs = gymnasium.make_vec(NAME, num_envs=2, vectorization_mode=mode, simulator=fake_arena)

    observations, infos = envs.reset(seed=[1, 2])
    stepped = envs.step(np.array([0, 1]))
    envs.close()

    assert observations.shape == stepped[0].shape == (2, *envs.single_observation_space.shape)
    assert infos["target"][0] != infos["target"][1]


def test_a_robot_without_its_scene_is_refused():
    """An episode would begin where the last one ended."""
    with pytest.raises(ConfigurationError, match="give both or neither"):
        make(robot=FakeRobotino())


def test_a_wrong_option_raises_an_error_before_a_simulator_is_requested():
    """A simulator takes seconds to start, and needs another process."""

    def never() -> tuple[FakeRobotino, FakeScene]:
        raise AssertionError("asked for a simulator")

    with pytest.raises(ConfigurationError, match="max_steps"):
        make(simulator=never, max_steps=0)


def test_an_unknown_role_raises_an_error_that_names_the_roles():
    """With a wrong role, no simulator would be found, and the message would be about simulators."""
    with pytest.raises(ConfigurationError, match=r'^role: "collect" is not a role; choose Collect or'):
        make(role="collect")


def test_an_environment_on_a_fake_robot_needs_no_ros():
    """People can develop rewards and algorithms on a machine without ROS."""
    program = f"""
        import sys
        sys.modules["rospy"] = None  # an import of it fails from now on
        import gymnasium
        from palaestra_trainer.testing import fake_arena
        env = gymnasium.make("palaestra_trainer.environments:{NAME}", simulator=fake_arena)
        env.reset(seed=1)
        env.step(0)
    """

    subprocess.run([sys.executable, "-c", textwrap.dedent(program)], check=True, timeout=60)


@pytest.mark.filterwarnings("ignore:.*different from the unwrapped version")
def test_the_checker_of_gymnasium_accepts_an_environment_that_was_made_with_a_robot():
    """The checker makes the environment again from copied arguments, but a robot cannot be copied."""
    robot, scene = fake_arena()
    robot.socket = threading.Lock()

    check_env(gymnasium.make(NAME, robot=robot, scene=scene))
