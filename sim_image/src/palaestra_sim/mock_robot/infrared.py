"""The distance that a Robotino reports for an infra-red sensor, from the voltage of the simulated sensor.

The lookup table in the world maps distances to volts, with noise. This module inverts the table, so the noise
of the world becomes noise of the distance. A sensor that sees nothing reports 0.41 m. Source: readings of a
Robotino with image 4.20.9.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Final

from palaestra_sim.scene.lookup_table import Row

OUT_OF_RANGE_M: Final = 0.41
_DEVIATIONS: Final = 4.0  # standard deviations; in one direction, noise exceeds them once in 30,000 readings


def distance_m(rows: Sequence[Row], value: float) -> float:
    """Return the distance in meters to which a lookup table assigns `value`, at most `OUT_OF_RANGE_M`.

    If several distances have this value, the farthest one is returned. If only noise separates the value from
    the last value of the table, the result is `OUT_OF_RANGE_M`: a sensor that sees nothing has such values.
    """
    _, last, noise = rows[-1]
    margin = _DEVIATIONS * noise * abs(last)
    if abs(value - last) <= margin or _beyond(rows, value):
        return OUT_OF_RANGE_M
    for (near_m, near, _), (far_m, far, _) in pairwise(reversed(rows)):
        if min(near, far) <= value <= max(near, far):
            share = (value - near) / (far - near) if far != near else 0.0
            return min(near_m + share * (far_m - near_m), OUT_OF_RANGE_M)
    return rows[0][0]


def _beyond(rows: Sequence[Row], value: float) -> bool:
    """Return whether a value lies past the end of the table, on the side of far distances."""
    falling = len(rows) > 1 and rows[-1][1] < rows[-2][1]
    return value < rows[-1][1] if falling else value > rows[-1][1]
