"""Convert a schedule that a job writes as text, as a list of points, or as the name of a function.

`lin_0.001` falls from 0.001 at the start of the training to 0 at its end, as in rl-baselines3-zoo. A list has
points [share of the steps, value], such as `[[0, 0.001], [0.5, 0.0002]]`. Between two points the value
changes linearly. Before the first point and after the last point the value is constant. A function of the
job's author is named as `module:function`; the model.zip contains only this name.

Stable-Baselines3 pickles the schedules of a model into its model.zip. So a schedule consists of classes and
functions of the standard library, NumPy and Stable-Baselines3, and the file has only their names and some
numbers. To load a class of this package, every reader of the file would need this package. If the file
contained the class as byte code, only the same version of Python could read it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from stable_baselines3.common.utils import LinearSchedule

from palaestra_trainer.errors import ConfigurationError, fact_of
from palaestra_trainer.job.user_code import imports

LINEAR = re.compile(r"lin_(\d+(?:\.\d*)?(?:e-?\d+)?)")
_TRIED = (1.0, 0.5, 0.0)  # the remaining shares of the steps with which the check calls a function


def schedule_of(value: Any) -> Callable[[float], float] | None:
    """Return the schedule that a value of a job describes; None if the value is not a schedule.

    The argument of the schedule is the remaining share of the training, from 1 to 0.
    """
    if isinstance(value, str) and (number := LINEAR.fullmatch(value)):
        return LinearSchedule(float(number[1]), 0.0, 1.0)
    return _through(value) if isinstance(value, list) and _are_points(value) else None


def _through(points: list[list[float]]) -> Callable[[float], float]:
    """Return a schedule that is linear between points [share of the steps, value], by increasing share."""
    left = [1.0 - share for share, _ in reversed(points)]
    return partial(np.interp, xp=left, fp=[float(value) for _, value in reversed(points)])


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


def own_schedule(name: str, field: str) -> Callable[[float], float]:
    """Return the function `name`, after a check of a few of its values.

    Args:
        name: `module:function`.
        field: field of the job, for messages.

    Raises:
        ConfigurationError: the function cannot be imported, or returns a value that is negative, infinite or
            not a number.
    """
    schedule: Callable[[float], float] = imports.object_named(name, f"{field}: {name}")
    for left in _TRIED:
        value = _value(schedule, left, f"{field}: {name}({left})")
        if not (math.isfinite(value) and value >= 0):
            raise ConfigurationError(
                f"{field}: {name}({left}) is {value}; return a finite number of 0 or more"
            )
    return schedule


def _value(schedule: Callable[[float], float], left: float, subject: str) -> float:
    try:
        return float(schedule(left))
    except Exception as error:  # the author's code may raise anything
        raise ConfigurationError(
            f"{subject} cannot be used ({fact_of(error)}); name a function that takes the remaining share "
            "of the steps, from 1.0 to 0.0, and returns a number"
        ) from error
