"""Numbers that nothing can be learnt from: NaN and infinity, where they come from."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from palaestra_trainer.errors import Diverged, WrongData


def check_observation(simulator: str, observation: Any) -> None:
    """Return if every number of an observation is finite; it may be a mapping of several.

    Raises:
        WrongData: one is not, whose place the message names.
    """
    if isinstance(observation, Mapping):
        for name, part in observation.items():
            _check_part(simulator, f"observation {name}", part)
    else:
        _check_part(simulator, "observation", observation)


def check_reward(simulator: str, reward: Any, info: Mapping[str, Any]) -> None:
    """Return if a reward is finite.

    Raises:
        Diverged: it is not; the message names the terms that are not, where the environment tells them.
    """
    if math.isfinite(reward):
        return
    terms = info.get("reward_terms", {})
    wrong = ", ".join(name for name, value in terms.items() if not math.isfinite(value))
    where = f" (term {wrong})" if wrong else ""
    raise Diverged(f"{simulator}: the reward is {float(reward)}{where}; mend the environment's reward")


def _check_part(simulator: str, name: str, part: Any) -> None:
    numbers = np.asarray(part)
    if numbers.dtype.kind != "f" or np.isfinite(numbers).all():
        return
    place = tuple(int(index) for index in np.argwhere(~np.isfinite(numbers))[0])
    raise WrongData(simulator, f"{name}{list(place)} is {numbers[place]}")
