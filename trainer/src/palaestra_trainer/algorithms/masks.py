"""Functions for algorithms that choose only actions that a mask of the environment allows."""

from __future__ import annotations

from typing import Any

import gymnasium
from sb3_contrib import MaskablePPO
from stable_baselines3.common.base_class import BaseAlgorithm

from palaestra_trainer.algorithms.registry import entry_of
from palaestra_trainer.environments.masks import ACTION_MASKS, gives_masks
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Algorithm


def is_masked(algorithm: Algorithm) -> bool:
    """Return whether an algorithm needs masks of allowed actions from its environment."""
    return issubclass(entry_of(algorithm.name).original, MaskablePPO)


def takes_masks(model: BaseAlgorithm) -> bool:
    """Return whether a model chooses only actions that a mask allows."""
    return isinstance(model, MaskablePPO)


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
