"""Schedules that a job writes as text or as a list of points.

`lin_0.001` falls from 0.001 at the start to 0 at the end, as in rl-baselines3-zoo. A list has points
[share of the steps, value], such as `[[0, 0.001], [0.5, 0.0002]]`, with straight lines between them. Before
the first and after the last point the value is constant.

A model.zip contains its schedules, and plain Stable-Baselines3 loads it without this package. The
registration at the end does that: everything that this process pickles has a copy of the class.
"""

from __future__ import annotations

import re
import sys
from itertools import pairwise
from typing import Any

import cloudpickle
from stable_baselines3.common.utils import LinearSchedule

LINEAR = re.compile(r"lin_(\d+(?:\.\d*)?(?:e-?\d+)?)")


class PiecewiseSchedule:
    """Straight lines between points.

    Args:
        points: [share of the steps, value] each, by increasing share, 0 to 1.
    """

    def __init__(self, points: list[list[float]]) -> None:
        self.points = [(float(share), float(value)) for share, value in points]

    def __call__(self, progress_remaining: float) -> float:
        """Return the value where `progress_remaining` (1 to 0) of the training is left."""
        share = 1.0 - progress_remaining
        if share <= self.points[0][0]:
            return self.points[0][1]
        for (before, low), (after, high) in zip(self.points, self.points[1:], strict=False):
            if share <= after:
                return low + (high - low) * (share - before) / (after - before)
        return self.points[-1][1]

    def __repr__(self) -> str:
        return f"PiecewiseSchedule({self.points})"


def schedule_of(value: Any) -> LinearSchedule | PiecewiseSchedule | None:
    """Return the schedule that a value of a job writes; None if it writes none."""
    if isinstance(value, str) and (number := LINEAR.fullmatch(value)):
        return LinearSchedule(float(number[1]), 0.0, 1.0)
    return PiecewiseSchedule(value) if isinstance(value, list) and _are_points(value) else None


def _are_points(value: list[Any]) -> bool:
    if not (value and all(map(_is_point, value))):
        return False
    shares = [share for share, _ in value]
    return all(one < other for one, other in pairwise(shares)) and 0 <= shares[0] <= shares[-1] <= 1


def _is_point(value: Any) -> bool:
    return (
        isinstance(value, list)
        and len(value) == len(("share", "value"))
        and all(isinstance(it, int | float) and not isinstance(it, bool) for it in value)
    )


cloudpickle.register_pickle_by_value(sys.modules[__name__])
