"""Generate the observations on which a file is compared with its policy; they are always the same.

The observations should be similar to those of episodes, but the bounds of a space do not show which numbers
are usual. A bound may be infinite, or the largest number of a type. Numbers drawn uniformly between such
bounds would saturate a network, and all actions would be the same. So the numbers of a Box have several
scales, from a hundredth up to the bounds. A network gives the same output for all images of noise, so the
images have areas of different brightness and contrast.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from stable_baselines3.common.preprocessing import is_image_space

from palaestra_trainer.exporting.policy_module import Normalizer, PolicyModule

EPISODE = 100  # number of observations with the same scale; then a recurrent policy begins a new episode
_FARTHEST = 1e4  # largest distance from the middle of a space, if its bounds allow a larger one
_NEAREST = 1e-2
_DEVIATIONS = 5.0  # largest distance from the mean in deviations, if the policy normalizes observations
_AREAS = 6  # number of areas along each side of an image
_LARGEST_WHOLE = 2.0**62  # float64 cannot hold the largest whole number of 64 bits


def drawn(acting: PolicyModule, count: int) -> dict[str, np.ndarray]:
    """Return `count` observations for each input of the policy."""
    observations = {}
    for number, (name, space) in enumerate(acting.spaces.items()):
        if isinstance(space, spaces.Box) and is_image_space(space):
            observations[name] = _images(space.shape, count, number)
        elif isinstance(space, spaces.Box):
            observations[name] = _numbers(space, acting.normalizers[number], count, number)
        else:
            space.seed(number)
            observations[name] = np.stack([np.asarray(space.sample()) for _ in range(count)])
    return observations


def drawn_masks(acting: PolicyModule, count: int) -> np.ndarray:
    """Return random masks that allow about half of the choices; shape (count, choices)."""
    generator = np.random.default_rng(0)
    parts = []
    for choices in acting.choices:
        part = generator.integers(2, size=(count, choices)).astype(np.bool_)
        part[np.arange(count), generator.integers(choices, size=count)] = True
        parts.append(part)
    return np.concatenate(parts, axis=1)


def magnitudes(acting: PolicyModule, observations: dict[str, np.ndarray]) -> np.ndarray:
    """Return for each observation the largest number that a network receives, at least 1.

    A network computes with 24 bits of precision, so the rounding errors of its actions grow with this number.
    """
    found = np.ones(len(next(iter(observations.values()))))
    for (name, space), normalize in zip(acting.spaces.items(), acting.normalizers, strict=True):
        if isinstance(space, spaces.Box) and not is_image_space(space):
            numbers = np.abs(observations[name].astype(np.float64)).reshape(len(found), -1).max(axis=1)
            limit = normalize.clip if isinstance(normalize, Normalizer) else np.inf
            found = np.maximum(found, np.minimum(numbers, limit))
    return found


def _images(shape: tuple[int, ...], count: int, seed: int) -> np.ndarray:
    """Return `count` random images of the shape (rows, columns, channels)."""
    rows, columns, channels = shape
    generator = np.random.default_rng(seed)
    areas = generator.uniform(-255.0, 255.0, (count, _AREAS, _AREAS, channels))
    brightness = generator.uniform(0.0, 255.0, (count, 1, 1, channels))
    contrast = generator.uniform(0.0, 1.0, (count, 1, 1, 1))
    painted: np.ndarray = np.clip(brightness + contrast * areas, 0.0, 255.0).astype(np.uint8)
    down, across = (np.arange(side) * _AREAS // side for side in (rows, columns))
    return painted[:, down[:, np.newaxis], across]


def _numbers(box: spaces.Box, normalize: Any, count: int, seed: int) -> np.ndarray:
    """Return random numbers of a Box, shape (count, *box.shape)."""
    low, high = (bound.astype(np.float64) for bound in (box.low, box.high))
    middle, farthest = _middle(low, high, normalize)
    far = np.random.default_rng(seed).uniform(-1.0, 1.0, (count, *box.shape)) * _scales(farthest, count)
    beyond = (middle + far < low) | (middle + far > high)
    numbers: np.ndarray = np.clip(middle + np.where(beyond, -far, far), low, high)
    if not np.issubdtype(box.dtype, np.floating):
        numbers = np.rint(np.clip(numbers, -_LARGEST_WHOLE, _LARGEST_WHOLE))
    return numbers.astype(box.dtype)


def _middle(low: np.ndarray, high: np.ndarray, normalize: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return the middle of a Box, and the largest distance of generated numbers from the middle."""
    if isinstance(normalize, Normalizer):
        return normalize.mean.numpy(), _DEVIATIONS * np.sqrt(normalize.variance.numpy() + normalize.epsilon)
    half = high / 2 - low / 2
    narrow = half <= _FARTHEST
    bounds = (np.where(narrow, bound, 0.0) for bound in (low, high))
    return np.where(narrow, sum(bounds) / 2, np.clip(0.0, low, high)), np.where(narrow, half, _FARTHEST)


def _scales(farthest: np.ndarray, count: int) -> np.ndarray:
    """Return each observation's scale: the largest in every other episode, smaller scales in the others."""
    episodes = np.arange(count) // EPISODE
    ladder = np.where(episodes % 2, (episodes // 2 % EPISODE) / max(1, episodes.max() // 2), 0.0)
    nearest = np.minimum(1.0, _NEAREST / np.maximum(farthest, _NEAREST))
    scales: np.ndarray = farthest * nearest ** ladder.reshape(-1, *[1] * farthest.ndim)
    return scales
