"""Copy the values that pass between the trainer and the code of a job's author.

An environment may return the same array at every step, write into an action, or keep the dict that it
returned. So the trainer and the environment never share an object.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np


def copied(value: Any) -> Any:
    """Return a copy that shares no array, dict, list or set with the original.

    A mapping of any class becomes a dict, because the original may be frozen. Objects of other classes are
    returned without a copy, because a copy of a robot or a socket would not work.
    """
    if isinstance(value, np.ndarray):
        return value.copy()
    if isinstance(value, Mapping):
        return {key: copied(part) for key, part in value.items()}
    if type(value) in (list, set, tuple):
        return type(value)(copied(part) for part in value)
    return bytearray(value) if isinstance(value, bytearray) else value
