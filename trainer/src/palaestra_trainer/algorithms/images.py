"""Image observations: their policy, and the order of their channels.

Environments return images with channels last. Stable-Baselines3 transposes them for PyTorch, so its models
see channels first. A checkpoint keeps them as environments return them.
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

SMALLEST = 36  # pixels per side that the convolutions of CnnPolicy need


def policy_for(space: spaces.Box, normalize: Normalize | None) -> str:
    """Return the name of Stable-Baselines3's policy for observations of a space.

    Raises:
        ConfigurationError: they are images that CnnPolicy cannot take.
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
    """Return an environment whose images have channels first; return any other unchanged.

    Stable-Baselines3 would transpose around a normalizer, whose statistics would then have another layout.
    """
    space = env.observation_space
    if isinstance(space, spaces.Box) and is_image_space(space) and not is_image_space_channels_first(space):
        return VecTransposeImage(env)
    return env


def as_returned(model: BaseAlgorithm, observations: Any) -> np.ndarray:
    """Return observations that a model saw in the layout of its environments."""
    seen = np.asarray(observations)
    return np.moveaxis(seen, 1, -1) if _transposes(model) else seen


def as_seen(model: BaseAlgorithm, observations: np.ndarray) -> np.ndarray:
    """Return observations of a model's environments in the layout that the model sees."""
    return np.moveaxis(observations, -1, 1) if _transposes(model) else observations


def _transposes(model: BaseAlgorithm) -> bool:
    env = model.get_env()
    return env is not None and is_vecenv_wrapped(env, VecTransposeImage)
