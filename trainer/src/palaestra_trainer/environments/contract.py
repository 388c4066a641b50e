"""Check the results of resets and steps against gymnasium's API; return mistakes as text for a message.

`mismatch` is a complete check of an observation. The checks of every reset and step run thousands of times a
second. So they are weaker, and accept a number beyond the bounds of a Box.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from gymnasium import spaces

Mismatch = Callable[[spaces.Space[Any], Any], str]
_LENGTHS = {"reset": 2, "step": 5}


def broken_by_reset(space: spaces.Space[Any], result: Any) -> str:
    """Return the mistake in the result of a reset; "" if the result is right."""
    if not isinstance(result, tuple) or len(result) != _LENGTHS["reset"]:
        return kind_of(result)
    return _unlike(space, result[0]) or _no_info(result[1])


def broken_by_step(space: spaces.Space[Any], result: Any) -> str:
    """Return the mistake in the result of a step; "" if the result is right."""
    if not isinstance(result, tuple) or len(result) != _LENGTHS["step"]:
        return kind_of(result)
    observation, reward, *ends, info = result
    if not isinstance(reward, int | float | np.integer | np.floating) or isinstance(reward, bool):
        return f"{kind_of(reward)} as reward"
    for name, value in zip(("terminated", "truncated"), ends, strict=True):
        if not isinstance(value, bool | np.bool_):
            return f"{kind_of(value)} as {name}"
    return _unlike(space, observation) or _no_info(info)


def kind_of(result: Any) -> str:
    """Return the class of a value as text; for a tuple, also the classes of its parts."""
    if isinstance(result, tuple):
        return f"a tuple of {len(result)}: ({', '.join(type(part).__name__ for part in result)})"
    return f"a {type(result).__name__}"


def _no_info(info: Any) -> str:
    return "" if isinstance(info, dict) else f"{kind_of(info)} as info"


def _unlike(space: spaces.Space[Any], observation: Any) -> str:
    """Return the difference in type, shape or keys between an observation and its space; "" if equal."""
    fact = _mismatch_of_kind(space, observation)
    return fact and f"an observation that does not fit its space ({fact})"


def _mismatch_of_kind(space: spaces.Space[Any], observation: Any) -> str:
    if isinstance(space, spaces.Box):
        return _mismatch_of_array(space, observation)
    if isinstance(space, spaces.Dict):
        return _mismatch_of_dict(space, observation, _mismatch_of_kind)
    return mismatch(space, observation)


def mismatch(space: spaces.Space[Any], observation: Any) -> str:
    """Return the reason why an observation is not in its space, as text; "" if it is in the space."""
    if isinstance(space, spaces.Dict):
        return _mismatch_of_dict(space, observation, mismatch)
    if isinstance(space, spaces.Box):
        return _mismatch_of_box(space, observation)
    if space.contains(observation):
        return ""
    return _mismatch_of_shape(space, observation) or repr(observation)


def _mismatch_of_dict(space: spaces.Dict, observation: Any, check: Mismatch) -> str:
    if not isinstance(observation, dict):
        return kind_of(observation)
    if observation.keys() != space.keys():
        return f"the keys {', '.join(map(str, observation))}, not {', '.join(space)}"
    facts = ((key, check(part, observation[key])) for key, part in space.items())
    return "; ".join(f"{key}: {fact}" for key, fact in facts if fact)


def _mismatch_of_shape(space: spaces.Space[Any], observation: Any) -> str:
    """Return the difference in shape; "" if the shapes are equal, or if the observation has no shape."""
    shape = getattr(observation, "shape", space.shape)
    return "" if shape == space.shape else f"shape {shape}, not {space.shape}"


def _mismatch_of_array(space: spaces.Box, observation: Any) -> str:
    """Return the difference in class, shape or dtype; "" if they are equal."""
    if not isinstance(observation, np.ndarray | np.generic):
        return kind_of(observation)
    if observation.dtype == space.dtype and observation.shape == space.shape:
        return ""
    return _mismatch_of_shape(space, observation) or f"dtype {observation.dtype}, not {space.dtype}"


def _mismatch_of_box(space: spaces.Box, observation: Any) -> str:
    if fact := _mismatch_of_array(space, observation):
        return fact
    numbers = np.asarray(observation)
    outside = np.argwhere((numbers < space.low) | (numbers > space.high))
    if not len(outside):
        return ""
    place = tuple(int(index) for index in outside[0])
    return f"{numbers[place]} at {list(place)}, not between {space.low[place]} and {space.high[place]}"
