"""Import schedules of a job's author, which are functions of the remaining share of the steps.

A job names such a function as `module:function`, and the model.zip contains only this name.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from palaestra_trainer.errors import ConfigurationError, fact_of
from palaestra_trainer.job.user_code import imports

_TRIED = (1.0, 0.5, 0.0)  # remaining shares of the steps


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
            f"{subject} cannot be used ({fact_of(error)}); name a function that takes the share of the steps "
            "that is left, 1.0 to 0.0, and returns a number"
        ) from error
