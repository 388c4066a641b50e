"""Find the problems of an environment; each problem is a sentence with a remedy."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.utils.env_checker import check_env as check_for_gymnasium
from stable_baselines3.common.env_checker import check_env as check_for_sb3

from palaestra_trainer.environments.contract import mismatch
from palaestra_trainer.environments.env_checker import plain_warning
from palaestra_trainer.errors import SimulatorFault, TrainerError, fact_of


class Problems:
    """The problems that were found, in the order in which they first occurred."""

    def __init__(self) -> None:
        self._found: Counter[str] = Counter()

    def add(self, sentence: str) -> None:
        """Add a problem; if it was added before, only count it."""
        self._found[sentence] += 1

    def __bool__(self) -> bool:
        return bool(self._found)

    def lines(self) -> list[str]:
        """Return each problem once, with a count if it occurred several times."""
        return [f"{line} ({count} times)" if count > 1 else line for line, count in self._found.items()]


def check_by_libraries(env: gymnasium.Env[Any, Any], problems: Problems) -> None:
    """Run the checkers of gymnasium and Stable-Baselines3 for some steps; add the problems that they find.

    Raises:
        SimulatorFault: the simulator failed.
    """
    checkers: tuple[tuple[str, Callable[..., Any], Any, dict[str, bool]], ...] = (
        (
            "gymnasium",
            check_for_gymnasium,
            env.unwrapped,
            {"skip_render_check": True, "skip_close_check": True},
        ),
        ("Stable-Baselines3", check_for_sb3, env, {}),
    )
    for library, check, checked, options in checkers:
        for fact in _objections(check, checked, options, problems):
            problems.add(f"the checker of {library} says: {fact.rstrip('.')}; fix the environment")


def beyond(space: spaces.Space[Any], observation: Any) -> str:
    """Return the problem of an observation outside its space, as a sentence; "" if it is in the space."""
    parts = space.items() if isinstance(space, spaces.Dict) else [("", space)]
    for name, part in parts:
        value = observation[name] if name else observation
        if fact := mismatch(part, value):
            # The sentence omits the numbers of a Box, because otherwise each step would add a new problem.
            where = f"observation {name}".rstrip()
            known = fact if not isinstance(part, spaces.Box) else _outside(part, np.asarray(value))
            return f"{where} is not in its space: {known}; widen the space, or clip the observation"
    return ""


def _outside(space: spaces.Box, value: np.ndarray) -> str:
    place = tuple(int(index) for index in np.argwhere((value < space.low) | (value > space.high))[0])
    return f"number {list(place)} is not between {space.low[place]} and {space.high[place]}"


def _objections(
    check: Callable[..., Any], env: Any, options: dict[str, bool], problems: Problems
) -> list[str]:
    """Return the objections of a checker; add an error of our own checks inside `env` to `problems`."""
    found: list[str] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            check(env, **options)
        except SimulatorFault:
            raise
        except TrainerError as error:
            problems.add(str(error))
        except (AssertionError, TypeError, ValueError, gymnasium.error.Error) as error:
            found.append(str(error) or fact_of(error))
    said = [*(str(each.message) for each in caught), *found]
    return list(dict.fromkeys(" ".join(plain_warning(each).split()) for each in said))
