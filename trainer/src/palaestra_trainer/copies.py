"""Copies of what crosses the border to somebody else's code.

An environment may return the same array at every step, write into an action, or keep the dict that it
returned. So what is kept on one side of the border is never the object of the other side.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np


def copied(value: Any) -> Any:
    """Return a value of which no array, dict, list or set is shared with the original.

    A mapping of any class becomes a dict, since it may be frozen. Objects of other classes are returned as
    they are: to copy a robot or a socket would be a fault of its own.
    """
    if isinstance(value, np.ndarray):
        return value.copy()
    if isinstance(value, Mapping):
        return {key: copied(part) for key, part in value.items()}
    if type(value) in (list, set, tuple):
        return type(value)(copied(part) for part in value)
    return bytearray(value) if isinstance(value, bytearray) else value
