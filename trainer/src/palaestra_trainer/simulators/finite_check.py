"""Refuse observations and rewards that are NaN or infinite as soon as they occur."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from palaestra_trainer.errors import Diverged
from palaestra_trainer.simulators.interface import Environment


def check_observation(simulator: str, env: Environment, observation: Any) -> None:
    """Check that every number of an observation, or of each part of a Dict, is finite.

    The robot has already checked its sensors, so a wrong number here comes from the environment's own code.

    Raises:
        Diverged: a number is not finite; the message names the environment and the number's index.
    """
    if isinstance(observation, np.ndarray) and not _not_finite(observation):
        return
    parts = observation if isinstance(observation, Mapping) else {"": observation}
    for name, part in parts.items():
        if fact := _not_finite(part):
            where = f"observation {name}".rstrip()
            raise Diverged(f"{simulator}: {_name(env)}: {where}{fact}; fix the environment")


def check_reward(simulator: str, env: Environment, reward: Any, info: Mapping[str, Any]) -> None:
    """Check that a reward is finite.

    Raises:
        Diverged: the reward is not finite; the message names the environment and the wrong reward terms in
            `info`.
    """
    if math.isfinite(reward):
        return
    terms = info.get("reward_terms", {})
    wrong = ", ".join(name for name, value in terms.items() if not math.isfinite(value))
    where = f" (term {wrong})" if wrong else ""
    fact = f"the reward is {float(reward)}{where}"
    raise Diverged(f"{simulator}: {_name(env)}: {fact}; fix the environment's reward")


def _not_finite(part: Any) -> str:
    """Return index and value of the first number that is not finite; "" if all are finite."""
    numbers = np.asarray(part)
    if numbers.dtype.kind != "f" or np.logical_and.reduce(np.isfinite(numbers), axis=None):
        return ""
    place = tuple(int(index) for index in np.argwhere(~np.isfinite(numbers))[0])
    return f"{list(place)} is {numbers[place]}"


def _name(env: Environment) -> str:
    inner = env.unwrapped
    return f"environment {inner.spec.id if inner.spec else type(inner).__name__}"
