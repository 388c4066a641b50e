"""Functions for algorithms that choose only actions that a mask of the environment allows."""

from __future__ import annotations

from typing import Any

import gymnasium
from sb3_contrib import MaskablePPO

from palaestra_trainer.algorithms.normalization import Normalized
from palaestra_trainer.algorithms.registry import entry_of
from palaestra_trainer.environments.masks import ACTION_MASKS, gives_masks
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Algorithm


def is_masked(algorithm: Algorithm) -> bool:
    """Return whether an algorithm needs masks of allowed actions from its environment."""
    return issubclass(entry_of(algorithm.name).original, MaskablePPO)


def takes_masks(policy: object) -> bool:
    """Return whether a model or a policy chooses only actions that a mask allows."""
    return isinstance(policy.model if isinstance(policy, Normalized) else policy, MaskablePPO)


def refuse_without_masks(algorithm: Algorithm, env: gymnasium.Env[Any, Any], name: str) -> None:
    """Refuse an environment without masks if the algorithm needs them.

    Args:
        algorithm: the algorithm of the job.
        env: the environment; its simulator need not have started.
        name: id of the environment.

    Raises:
        ConfigurationError: the environment has no method `action_masks`.
    """
    if is_masked(algorithm) and not gives_masks(env):
        raise ConfigurationError(
            f"environment.id: {name} has no method {ACTION_MASKS}, which {algorithm.name} calls to get the "
            f"allowed actions; define {ACTION_MASKS}(self), which returns a bool for each action, or use PPO"
        )


def predict_allowed(policy: Any, masks: Any, *seen: Any, deterministic: bool = True) -> tuple[Any, Any]:
    """Return an action that the masks allow, and the policy's next state.

    Args:
        policy: a policy for which `takes_masks` is True.
        masks: masks as `action_masks` returns them.
        seen: the observation, the state and the flag `episode_start`, as for the policy's `predict`.
        deterministic: whether to choose the most probable action.
    """
    action, state = policy.predict(*seen, deterministic=deterministic, action_masks=masks)
    return action, state
