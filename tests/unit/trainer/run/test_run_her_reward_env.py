"""The environment that computes rewards for hindsight experience replay; it needs no simulator."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from palaestra_trainer.errors import ConfigurationError, MissingCapability
from palaestra_trainer.job.configuration import Configuration, Environment
from palaestra_trainer.robots import Gripper, Scanner
from palaestra_trainer.run.her_reward_env import make_judge
from palaestra_trainer.webots.facade import open_facades


class Reach(gymnasium.Env):
    """A task with goals whose robot needs a scanner."""

    needs = (Scanner,)
    observation_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
    action_space = spaces.Discrete(2)

    def __init__(self, robot, scene):
        self.robot, self.scene = robot, scene
        robot.use_scanner()

    def compute_reward(self, achieved, desired, info):
        """Return 1 for each goal that was reached, otherwise 0."""
        del info
        return np.all(achieved == desired, axis=-1).astype(np.float32)


@pytest.fixture
def job():
    """`job(task, robot)` registers the task for the test, and returns the configuration of a run."""

    def write(task, robot=None, **more):
        gymnasium.register(id="Reach-v0", entry_point=task)
        simulator = {"name": "collect-0", "group": "collect", "index": 0, "role": "Collect"}
        environment = Environment(id="Reach-v0", **more)
        return Configuration(job="j", environment=environment, robot=robot, steps=1, simulators=[simulator])

    yield write
    gymnasium.registry.pop("Reach-v0", None)


def test_the_judge_has_the_robot_of_the_job(job):
    """A task for two wheels and a scanner must be able to learn from goals too."""
    judge = make_judge(job(Reach, "TurtleBot3Burger"))

    goals = np.array([[0.0, 1.0], [0.0, 2.0]])
    assert type(judge.unwrapped.robot).__name__ == "TurtleBot3Burger"
    assert judge.unwrapped.compute_reward(goals, goals[:1], {}).tolist() == [1.0, 0.0]


def test_a_wrapper_that_changes_rewards_is_refused_and_another_is_not(job):
    """A batch would mix rewards with the wrapper and, for other goals, rewards without it."""
    limit = {"name": "gymnasium.wrappers:TimeLimit", "options": {"max_episode_steps": 5}}
    clip = {"name": "gymnasium.wrappers:ClipReward", "options": {"max_reward": 1}}
    limited = job(Reach, wrappers=[limit])
    clipped = limited.model_copy(update={"environment": Environment(id="Reach-v0", wrappers=[clip])})

    assert make_judge(limited).get_wrapper_attr("compute_reward")

    with pytest.raises(
        ConfigurationError, match=r"environment\.wrappers: ClipReward changes rewards, and Her"
    ):
        make_judge(clipped)


def test_without_a_robot_in_the_job_the_judge_has_a_robotino(job):
    """A Robotino has all capabilities, and is the default robot of the simulators."""

    class Grasp(Reach):
        needs = (Gripper, Scanner)

    assert type(make_judge(job(Grasp)).unwrapped.robot).__name__ == "Robotino"


def test_a_robot_that_does_not_fit_the_task_is_refused_by_its_own_name(job):
    """The robot is checked before a simulator starts, so a person waits only seconds for the error."""
    with pytest.raises(
        MissingCapability, match=r"trainer\.robot: EPuck has no Scanner, which Reach-v0 needs"
    ):
        make_judge(job(Reach, "EPuck"))


def test_a_task_that_computes_no_rewards_of_goals_is_refused(job):
    """Hindsight experience replay would fail at its first sample."""

    class Blind(Reach):
        compute_reward = None

    with pytest.raises(ConfigurationError, match=r"environment\.id: Reach-v0 has no compute_reward"):
        make_judge(job(Blind))


def test_the_judge_s_simulator_is_offered_to_no_environment(job):
    """There is no simulator behind this facade, so no environment of a user may get it."""
    make_judge(job(Reach))

    assert open_facades.offered() is None
