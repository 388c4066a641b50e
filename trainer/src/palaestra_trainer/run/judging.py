"""An environment without a simulator, which computes the rewards of goals for hindsight experience replay.

The collecting environments cannot do it: their simulators may be restarting in other threads while the
algorithm learns. The environment gets the fake robot that ships, and is never reset or stepped.
"""

from __future__ import annotations

from typing import Any

import gymnasium

from palaestra_trainer.configuration import Environment
from palaestra_trainer.environments.making import make_environment
from palaestra_trainer.episodes.vec_env import COMPUTE_REWARD
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.testing import fake_seeing


def make_judge(wanted: Environment) -> gymnasium.Env[Any, Any]:
    """Return an environment of a job whose `compute_reward` may be called at any time.

    Raises:
        ConfigurationError: it cannot be made with the fake robot, or has no `compute_reward`.
    """
    judge = make_environment(wanted, *fake_seeing())
    if not callable(getattr(judge.unwrapped, COMPUTE_REWARD, None)):
        raise ConfigurationError(
            f"environment.id: {wanted.id} has no {COMPUTE_REWARD}, which HerReplayBuffer needs; add it as in "
            "gymnasium-robotics, or remove replay_buffer_class"
        )
    return judge
