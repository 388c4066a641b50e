"""Agents that choose actions without a trained policy: zeros, and random actions."""

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
    """The person asks for the next episode."""


class EndTry(Exception):
    """The person ends the program."""


class Agent(Protocol):
    """The interface of an object that chooses actions."""

    def act(self, mask: np.ndarray | None) -> Any:
        """Return the next action; `mask` has the allowed choices, and None allows all.

        Raises:
            EndEpisode, EndTry: the person ends the episode or the program.
        """
        ...

    def got(self, step: int, reward: float) -> None:
        """Receive the reward of a step; the steps of an episode are counted from 1."""
        ...


class Zero:
    """Always chooses the same action: zero, or the action nearest to zero within the bounds.

    In a Discrete space this is the first action. Masks have no effect.
    """

    def __init__(self, space: spaces.Space[Any]) -> None:
        self._action = zero_of(space)

    def act(self, mask: np.ndarray | None) -> Any:
        """Return the same action at each call."""
        del mask
        return self._action

    def got(self, step: int, reward: float) -> None:
        """Ignore the reward."""


class Random:
    """Chooses random allowed actions, all equally likely; the same seed gives the same actions."""

    def __init__(self, space: spaces.Space[Any], seed: int) -> None:
        self._space = deepcopy(space)  # the environment may draw from the generator of its own action space
        self._random = np.random.default_rng(seed)
        self._space.seed(seed)

    def act(self, mask: np.ndarray | None) -> Any:
        """Return a random allowed action."""
        if mask is None:
            return self._space.sample()
        parts = np.split(mask, np.cumsum(choices_of(self._space))[:-1])
        chosen = [int(self._random.choice(np.flatnonzero(part))) for part in parts]
        space: Any = self._space
        if isinstance(self._space, spaces.Discrete):
            return space.dtype.type(chosen[0] + space.start)
        return np.asarray(np.reshape(np.array(chosen), space.shape) + getattr(space, "start", 0), space.dtype)

    def got(self, step: int, reward: float) -> None:
        """Ignore the reward."""


def zero_of(space: spaces.Space[Any]) -> Any:
    """Return the zero of a space, or the point of the space that is nearest to zero."""
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
    """Return the names of an environment's discrete actions, in order; () without names.

    In Palaestra's environments, the option `movements` has these names.
    """
    movements = getattr(getattr(env.unwrapped, "options", None), "movements", ())
    return tuple(str(movement.name).lower() for movement in movements)


MakeAgent = Callable[[gymnasium.Env[Any, Any]], Agent]
