"""An environment without a simulator, which computes the rewards of goals for hindsight experience replay.

The collecting environments cannot compute them: their simulators may be restarting in other threads while the
algorithm learns. This environment gets a robot of the job's class that is never connected. The environment is
never reset or stepped. Environments of simulators are also created with robots that are not connected yet, so
each environment that works there can be created here.
"""

from __future__ import annotations

from typing import Any

import gymnasium

from palaestra_trainer.episodes.vec_env import COMPUTE_REWARD
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Configuration
from palaestra_trainer.simulators.connect import unconnected_environment

# No simulator has this name. So an environment that reads a sensor gets SimulatorDead with this name.
_NAME = "judge"


def make_judge(wanted: Configuration) -> gymnasium.Env[Any, Any]:
    """Return an environment of a job whose `compute_reward` may be called at any time.

    Raises:
        ConfigurationError: the environment does not fit the job's robot, or has no `compute_reward`.
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
    """Refuse wrappers that change the reward of a step, because `compute_reward` does not use them."""
    while isinstance(env, gymnasium.Wrapper):
        if isinstance(env, gymnasium.RewardWrapper):
            raise ConfigurationError(
                f"environment.wrappers: {type(env).__name__} changes rewards, and HerReplayBuffer computes "
                f"those of other goals by {COMPUTE_REWARD}, without it; remove it, or replay_buffer_class"
            )
        env = env.env
