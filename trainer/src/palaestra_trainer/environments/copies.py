"""Copy the values that pass between the trainer and the code of a job's author.

An environment may return the same array at every step, write into an action, or keep the dict that it
returned. So the trainer and the environment never share an object.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

# Most values of an info have one of these types, which need no copy and no slower test of their type.
_IMMUTABLE: Final = frozenset({bool, float, int, str, type(None), np.bool_, np.float32, np.float64, np.int64})


def copied(value: Any) -> Any:
    """Return a copy that shares no array, dict, list or set with the original.

    A mapping of any class becomes a dict, because the original may be frozen. Objects of other classes are
    returned without a copy, because a copy of a robot or a socket would not work.
    """
    if type(value) in _IMMUTABLE:
        return value
    if isinstance(value, np.ndarray):
        return value.copy()
    if type(value) is dict or isinstance(value, Mapping):
        return {key: copied(part) for key, part in value.items()}
    if type(value) in (list, set, tuple):
        return type(value)(copied(part) for part in value)
    return bytearray(value) if isinstance(value, bytearray) else value
