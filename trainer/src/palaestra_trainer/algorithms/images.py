"""The network for image observations, and the order of their channels.

Environments return images with channels last. Stable-Baselines3 transposes these images for PyTorch, so its
models get images with channels first. A checkpoint stores images in the layout of the environments.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any, Final

import numpy as np
from gymnasium import spaces
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.preprocessing import is_image_space_channels_first
from stable_baselines3.common.vec_env import VecEnv, VecTransposeImage, unwrap_vec_wrapper

from palaestra_trainer.algorithms.observations import Observations
from palaestra_trainer.algorithms.small_cnn import SmallCnn
from palaestra_trainer.algorithms.space_compat import images_in
from palaestra_trainer.job.configuration import Cnn

_NOTE: Final = "transposed_images"


def with_network(policy_kwargs: dict[str, Any], cnn: Cnn | None) -> dict[str, Any]:
    """Return the arguments of the policy, with the network for images if the job sets `cnn`."""
    if cnn is None:
        return policy_kwargs
    # As with NatureCNN, the output layer follows the features directly, unless the job sets `net_arch`.
    return {"net_arch": [], **policy_kwargs, "features_extractor_class": SmallCnn}


def with_channels_first(env: VecEnv) -> VecEnv:
    """Return the environment with the channels of its images first; if it has no images, return it unchanged.

    Without this wrapper, Stable-Baselines3 would transpose the images after the normalizer. The statistics of
    the normalizer would then have another layout than the observations of the model.
    """
    last = [image for image in images_in(env.observation_space) if not is_image_space_channels_first(image)]
    return VecTransposeImage(env) if last else env


def note_transposed(model: BaseAlgorithm) -> None:
    """Note on a model which images it gets transposed; the model's zip has the note."""
    setattr(model, _NOTE, [key or "" for key in _transposed(model)])


def transposed_images(model: BaseAlgorithm) -> Collection[str] | None:
    """Return the keys of images that a model gets transposed, "" for an observation that is an image.

    None: an older release saved the model, which does not note the keys.
    """
    noted: Collection[str] | None = getattr(model, _NOTE, None)
    return noted


def as_returned(model: BaseAlgorithm, observations: Observations) -> Observations:
    """Convert observations from the layout of a model to that of its environments."""
    if isinstance(observations, dict):
        keys = _transposed(model)
        return {key: _channels_last(seen) if key in keys else seen for key, seen in observations.items()}
    return _channels_last(observations) if _transposed(model) else observations


def as_seen(model: BaseAlgorithm, observations: Observations) -> Observations:
    """Convert observations from the layout of a model's environments to that of the model."""
    if isinstance(observations, dict):
        keys = _transposed(model)
        return {key: _channels_first(part) if key in keys else part for key, part in observations.items()}
    return _channels_first(observations) if _transposed(model) else observations


def _channels_last(images: np.ndarray) -> np.ndarray:
    return np.moveaxis(images, 1, -1)


def _channels_first(images: np.ndarray) -> np.ndarray:
    return np.moveaxis(images, -1, 1)


def _transposed(model: BaseAlgorithm) -> Sequence[str | None]:
    """Return the keys of images that are transposed for a model; [None] if the observation is an image."""
    env = model.get_env()
    wrapper = None if env is None else unwrap_vec_wrapper(env, VecTransposeImage)
    if not isinstance(wrapper, VecTransposeImage):
        return []
    return wrapper.image_space_keys if isinstance(wrapper.observation_space, spaces.Dict) else [None]
