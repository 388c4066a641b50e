"""Image observations: which policy they get, and where their channels lie.

Environments return images with channels last. Stable-Baselines3 transposes them for PyTorch, so its models
see channels first. What a checkpoint keeps is as environments return it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.preprocessing import is_image_space, is_image_space_channels_first
from stable_baselines3.common.vec_env import VecEnv, VecTransposeImage, is_vecenv_wrapped

from palaestra_trainer.configuration import Normalize
from palaestra_trainer.errors import ConfigurationError

SMALLEST = 36  # pixels of a side that the convolutions of CnnPolicy need


def policy_for(space: spaces.Box, normalize: Normalize | None) -> str:
    """Return the name of Stable-Baselines3's policy for observations of a space.

    Raises:
        ConfigurationError: it is of images that the policy for images cannot take.
    """
    if not is_image_space(space):
        return "MlpPolicy"
    if normalize and normalize.observations:
        raise ConfigurationError(
            "algorithm.normalize.observations: CnnPolicy scales images itself; set it to false"
        )
    sides = space.shape[1:] if is_image_space_channels_first(space) else space.shape[:2]
    if min(sides) < SMALLEST:
        raise ConfigurationError(
            f"environment.id: its images have {sides[0]} x {sides[1]} pixels, and CnnPolicy needs "
            f"{SMALLEST} x {SMALLEST}; make them larger, or flatten them"
        )
    return "CnnPolicy"


def with_channels_first(env: VecEnv) -> VecEnv:
    """Return an environment whose images have channels first; any other is returned as it is.

    Stable-Baselines3 would do the same around a normalizer, which would keep another layout than is learned.
    """
    space = env.observation_space
    if isinstance(space, spaces.Box) and is_image_space(space) and not is_image_space_channels_first(space):
        return VecTransposeImage(env)
    return env


def as_returned(model: BaseAlgorithm, observations: Any) -> np.ndarray:
    """Return observations that a model saw as its environments returned them."""
    seen = np.asarray(observations)
    return np.moveaxis(seen, 1, -1) if _transposes(model) else seen


def as_seen(model: BaseAlgorithm, observations: np.ndarray) -> np.ndarray:
    """Return observations of a model's environments as the model sees them."""
    return np.moveaxis(observations, -1, 1) if _transposes(model) else observations


def _transposes(model: BaseAlgorithm) -> bool:
    env = model.get_env()
    return env is not None and is_vecenv_wrapped(env, VecTransposeImage)
