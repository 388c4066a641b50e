"""Image observations: their policy with its network, and the order of their channels.

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

from palaestra_trainer.algorithms.small_cnn import SmallCnn
from palaestra_trainer.configuration import Algorithm, Cnn
from palaestra_trainer.errors import ConfigurationError

# Pixels per side that the convolutions of each network need.
SMALLEST: dict[Cnn | None, int] = {None: 36, "small": 20}


def policy_for(space: spaces.Box, algorithm: Algorithm) -> str:
    """Return the name of Stable-Baselines3's policy for observations of a space.

    Raises:
        ConfigurationError: they are images that CnnPolicy cannot take, or no images for `cnn`.
    """
    if not is_image_space(space):
        if algorithm.cnn:
            raise ConfigurationError(
                "algorithm.cnn: has no effect, since the environment's observation is no image; remove it"
            )
        return "MlpPolicy"
    if algorithm.normalize and algorithm.normalize.observations:
        raise ConfigurationError(
            "algorithm.normalize.observations: CnnPolicy scales images itself; set it to false"
        )
    sides = space.shape[1:] if is_image_space_channels_first(space) else space.shape[:2]
    smallest = SMALLEST[algorithm.cnn]
    if min(sides) < smallest:
        raise ConfigurationError(
            f"environment.id: its images have {sides[0]} x {sides[1]} pixels, and CnnPolicy needs "
            f"{smallest} x {smallest}; make them larger, or flatten them"
        )
    return "CnnPolicy"


def with_network(policy_kwargs: dict[str, Any], cnn: Cnn | None) -> dict[str, Any]:
    """Return the policy's arguments with the network for images that the algorithm names."""
    if cnn is None:
        return policy_kwargs
    # As with NatureCNN, nothing is between features and outputs unless `net_arch` names layers.
    return {"net_arch": [], **policy_kwargs, "features_extractor_class": SmallCnn}


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
