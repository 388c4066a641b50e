"""The outline of a robot, seen from above: discs that are fixed in its frame.

A disc keeps its shape however the robot turns, so a contact costs the same at every heading. A box becomes a
row of discs, with its length and its width, and with round corners.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

_MOST_DISCS: Final = 16  # of one box; a bar more than eight times as long as wide has gaps between them


class RoundPart(NamedTuple):
    """A disc in the robot's frame: x and y of its center and its radius, in meters."""

    x_m: float
    y_m: float
    radius_m: float


def discs_of_box(
    x_m: float, y_m: float, heading_rad: float, length_m: float, width_m: float
) -> tuple[RoundPart, ...]:
    """Return discs that cover a box but for its corners, and reach no further than the box.

    The box has its center at x, y and its length along the heading. The discs stand along its longer axis, at
    most a radius apart, so a long side dips by 7 % of the width at most.
    """
    if width_m > length_m:
        return discs_of_box(x_m, y_m, heading_rad + math.pi / 2.0, width_m, length_m)
    radius_m = width_m / 2.0
    row_m = length_m - width_m  # from the first center to the last
    gaps = _MOST_DISCS - 1
    if row_m < gaps * radius_m:
        gaps = math.ceil(row_m / radius_m)
    c = math.cos(heading_rad)
    s = math.sin(heading_rad)
    places = (row_m * (index / gaps - 0.5) if gaps else 0.0 for index in range(gaps + 1))
    return tuple(RoundPart(x_m + c * place, y_m + s * place, radius_m) for place in places)
