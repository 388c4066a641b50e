"""Agents that act in an environment before training: zeros, and random actions."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from typing import Any, Protocol

import gymnasium
import numpy as np
from gymnasium import spaces

from palaestra_trainer.environments.masks import choices_of

AGENTS = ("zero", "random", "keyboard")


class EndEpisode(Exception):
    """The person begins the next episode."""


class EndTry(Exception):
    """The person has seen enough."""


class Agent(Protocol):
    """Chooses actions."""

    def act(self, mask: np.ndarray | None) -> Any:
        """Return the next action; `mask` has the allowed choices, None: all are allowed.

        Raises:
            EndEpisode, EndTry: a person wants no further action.
        """
        ...

    def got(self, step: int, reward: float) -> None:
        """Take note of the reward of a step, counted from 1 in its episode."""
        ...


class Zero:
    """Chooses the same action always: zero, or the one within the bounds that is nearest to it.

    Of a Discrete space that is the first action; masks have no effect.
    """

    def __init__(self, space: spaces.Space[Any]) -> None:
        self._action = zero_of(space)

    def act(self, mask: np.ndarray | None) -> Any:
        """Return the action."""
        del mask
        return self._action

    def got(self, step: int, reward: float) -> None:
        """Ignore it."""


class Random:
    """Chooses among all allowed actions, all equally likely; the same seed chooses the same ones."""

    def __init__(self, space: spaces.Space[Any], seed: int) -> None:
        self._space = deepcopy(space)  # the environment may draw from the generator of its own action space
        self._random = np.random.default_rng(seed)
        self._space.seed(seed)

    def act(self, mask: np.ndarray | None) -> Any:
        """Return the action."""
        if mask is None:
            return self._space.sample()
        parts = np.split(mask, np.cumsum(choices_of(self._space))[:-1])
        chosen = [int(self._random.choice(np.flatnonzero(part))) for part in parts]
        space: Any = self._space
        if isinstance(self._space, spaces.Discrete):
            return space.dtype.type(chosen[0] + space.start)
        return np.asarray(np.reshape(np.array(chosen), space.shape) + getattr(space, "start", 0), space.dtype)

    def got(self, step: int, reward: float) -> None:
        """Ignore it."""


def zero_of(space: spaces.Space[Any]) -> Any:
    """Return the zero of a space, or the nearest point to it."""
    known: Any = space
    match space:
        case spaces.Box():
            return np.clip(np.zeros(space.shape, space.dtype), space.low, space.high)
        case spaces.Discrete():
            return known.dtype.type(known.start)
        case spaces.MultiDiscrete():
            return np.asarray(space.start)
        case spaces.Dict():
            return {key: zero_of(part) for key, part in space.items()}
        case spaces.Tuple():
            return tuple(map(zero_of, space))
        case _:
            return np.zeros(space.shape or (), space.dtype)


def names_of_actions(env: gymnasium.Env[Any, Any]) -> tuple[str, ...]:
    """Return the names of an environment's discrete actions, in order; () if it names none.

    Palaestra's environments name them `movements` in their options.
    """
    movements = getattr(getattr(env.unwrapped, "options", None), "movements", ())
    return tuple(str(movement.name).lower() for movement in movements)


MakeAgent = Callable[[gymnasium.Env[Any, Any]], Agent]
