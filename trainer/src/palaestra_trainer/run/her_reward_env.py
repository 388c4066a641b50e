"""Create an environment that computes rewards for hindsight experience replay and needs no simulator.

The collecting environments cannot compute these rewards, because their simulators may be restarting in other
threads while the algorithm learns. This environment is never reset or stepped. Its robot has the job's class
and is never connected. The environments of simulators are also created before their robots are connected. So
the class of every job's environment can be created with an unconnected robot.
"""

from __future__ import annotations

from typing import Any

import gymnasium

from palaestra_trainer.episodes.vec_env import COMPUTE_REWARD
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Configuration
from palaestra_trainer.simulators.connect import unconnected_environment

# No simulator has this name. If `compute_reward` reads a sensor, the sensor raises SimulatorDead with this
# name.
_NAME = "judge"


def make_judge(wanted: Configuration) -> gymnasium.Env[Any, Any]:
    """Return a job's environment whose `compute_reward` can be called at any time.

    Raises:
        ConfigurationError: the environment does not accept the job's robot, or has no `compute_reward`.
    """
    judge = unconnected_environment(wanted, _NAME)
    if not callable(getattr(judge.unwrapped, COMPUTE_REWARD, None)):
        raise ConfigurationError(
            f"environment.id: {wanted.environment.id} has no {COMPUTE_REWARD}, which HerReplayBuffer needs; "
            "add it as in gymnasium-robotics, or remove replay_buffer_class"
        )
    _refuse_other_rewards(judge)
    return judge


def _refuse_other_rewards(env: gymnasium.Env[Any, Any]) -> None:
    """Refuse wrappers that change rewards, because `compute_reward` would not apply them."""
    while isinstance(env, gymnasium.Wrapper):
        if isinstance(env, gymnasium.RewardWrapper):
            raise ConfigurationError(
                f"environment.wrappers: {type(env).__name__} changes rewards, and HerReplayBuffer computes "
                f"the rewards of other goals by {COMPUTE_REWARD} without this wrapper; remove the wrapper, "
                "or replay_buffer_class"
            )
        env = env.env
