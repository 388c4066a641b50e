"""Functions of arrays that return the same bits as Python's `math`; NumPy's results have other bits."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

TURN: Final = 2.0 * math.pi


def cosines(angles: Any) -> Any:
    """Return the cosine of each angle."""
    return np.fromiter(map(math.cos, angles.tolist()), np.float64, len(angles))


def sines(angles: Any) -> Any:
    """Return the sine of each angle."""
    return np.fromiter(map(math.sin, angles.tolist()), np.float64, len(angles))


def arc_tangents(y: Any, x: Any) -> Any:
    """Return the angle of each vector."""
    return np.fromiter(map(math.atan2, y.tolist(), x.tolist()), np.float64, len(y))


def within_half_turn(angles: Any) -> Any:
    """Return each angle in [-pi, pi], as `math.remainder(angle, 2 * pi)`.

    Both operations are exact: C's fmod, and the subtraction of a whole turn from a rest that is between half
    a turn and a whole turn.
    """
    rest = np.fmod(angles, TURN)
    return np.where(np.abs(rest) > math.pi, rest - np.copysign(TURN, rest), rest)
