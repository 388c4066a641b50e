"""Masks of actions, which an environment returns by its method `action_masks`, as sb3-contrib calls it.

A mask has one truth value for each choice: of a Discrete for each action, of a MultiDiscrete for each value
of its first number, then of its second, and so on, of a MultiBinary for 0 and 1 of each of its numbers.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from palaestra_trainer.errors import ConfigurationError

ACTION_MASKS = "action_masks"
_METHOD = f"{ACTION_MASKS}(self)"


def gives_masks(env: gymnasium.Env[Any, Any]) -> bool:
    """Return whether the environment, or a wrapper around it, has the method `action_masks`."""
    return env.has_wrapper_attr(ACTION_MASKS) and callable(env.get_wrapper_attr(ACTION_MASKS))


def choices_of(space: spaces.Space[Any]) -> list[int]:
    """Return the number of choices of each number of an action.

    Raises:
        TypeError: actions of this kind have no masks.
    """
    match space:
        case spaces.Discrete():
            return [int(space.n)]
        case spaces.MultiDiscrete():
            return [int(choices) for choices in space.nvec.flat]
        case spaces.MultiBinary():
            return [2] * int(np.prod(space.shape))
        case _:
            raise TypeError(f"{type(space).__name__} actions have no masks")


def all_allowed(space: spaces.Space[Any]) -> np.ndarray:
    """Return the mask that allows every action."""
    return np.ones(sum(choices_of(space)), np.bool_)


def mask_of(env: gymnasium.Env[Any, Any]) -> np.ndarray:
    """Return a copy of the mask that the environment returns now; shape (choices,), bool.

    Raises:
        ConfigurationError: it is no mask of the environment's actions, or allows none.
    """
    given = env.get_wrapper_attr(ACTION_MASKS)()
    choices = choices_of(env.action_space)
    try:
        mask = np.asarray(given)
    except ValueError as error:
        raise _wrong(
            env, f"one array of {sum(choices)} truth values", "lists of different lengths"
        ) from error
    if mask.size != sum(choices):
        came = f"an array of shape {mask.shape}"
        raise _wrong(env, f"{sum(choices)} truth values, one for each choice of {env.action_space}", came)
    if mask.dtype.kind not in "biuf" or not np.isin(mask, (0, 1)).all():
        raise _wrong(env, "truth values", f"{mask.dtype} values such as {_odd(mask)!r}")
    mask = mask.ravel().astype(np.bool_)
    for number, part in enumerate(_parts(mask, choices)):
        if not part.any():
            where = f" for number {number} of the action" if len(choices) > 1 else ""
            raise _wrong(env, f"at least one choice allowed{where}", "none")
    return mask


def allows(mask: np.ndarray, space: spaces.Space[Any], action: Any) -> bool:
    """Return whether a mask of the space allows the action."""
    chosen = np.asarray(action).ravel().astype(np.int64)
    return all(bool(part[at]) for part, at in zip(_parts(mask, choices_of(space)), chosen, strict=True))


def _parts(mask: np.ndarray, choices: list[int]) -> list[np.ndarray]:
    return np.split(mask, np.cumsum(choices)[:-1])


def _odd(mask: np.ndarray) -> Any:
    """Return the first value that is no truth value."""
    values = mask.ravel().tolist()
    return next((value for value in values if value not in (0, 1)), values[0])


def _wrong(env: gymnasium.Env[Any, Any], expected: str, came: str) -> ConfigurationError:
    inner = env.unwrapped
    name = inner.spec.id if inner.spec else type(inner).__name__
    return ConfigurationError(
        f"environment.id: {name}: expected from {_METHOD} {expected}; got {came}; fix the environment"
    )
