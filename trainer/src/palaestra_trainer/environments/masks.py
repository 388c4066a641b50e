"""Masks of actions, as an environment returns them from its method `action_masks` for sb3-contrib.

A mask has one truth value for each choice. In a Discrete space each action is a choice. In a MultiDiscrete
space the mask begins with the choices of the first number, then follow the choices of the second number, and
so on. In a MultiBinary space each number has two choices: 0, then 1.
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from palaestra_trainer.errors import ConfigurationError

ACTION_MASKS = "action_masks"


def gives_masks(env: gymnasium.Env[Any, Any]) -> bool:
    """Return whether the environment or one of its wrappers has the method `action_masks`."""
    return env.has_wrapper_attr(ACTION_MASKS) and callable(env.get_wrapper_attr(ACTION_MASKS))


def choices_of(space: spaces.Space[Any]) -> list[int]:
    """Return the count of choices for each number of an action.

    Raises:
        TypeError: actions of this type of space have no masks.
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


def masks_in(given: Any, space: spaces.Space[Any], *, count: int | None = None) -> np.ndarray:
    """Return masks of actions as truth values; shape (masks, choices).

    Args:
        given: one mask or several masks, of any shape.
        space: the space of the actions.
        count: the number of masks; None: any number.

    Raises:
        ValueError: a value is not a mask of this space, or a mask does not allow any action.
    """
    choices = choices_of(space)
    expected = f"expected {sum(choices)} truth values, one for each choice of {space}; got"
    try:
        masks = np.asarray(given)
    except ValueError as error:
        raise ValueError(f"{expected} lists of different lengths") from error
    found, rest = divmod(masks.size, sum(choices))
    if rest or found != (count or max(1, found)):
        raise ValueError(f"{expected} an array of shape {masks.shape}")
    if masks.dtype.kind not in "biuf" or not np.isin(masks, (0, 1)).all():
        raise ValueError(f"{expected} {masks.dtype} values such as {_odd(masks)!r}")
    rows = masks.reshape(-1, sum(choices)).astype(np.bool_)
    for number, part in enumerate(_parts(rows, choices)):
        if not part.any(axis=-1).all():
            where = f" for number {number} of the action" if len(choices) > 1 else ""
            raise ValueError(f"expected at least one allowed choice{where}; got none")
    return rows


def mask_of(env: gymnasium.Env[Any, Any]) -> np.ndarray:
    """Return a copy of the environment's current mask; shape (choices,), bool.

    Raises:
        ConfigurationError: the value is not a mask of the environment's actions, or allows no action.
    """
    given = env.get_wrapper_attr(ACTION_MASKS)()
    try:
        mask: np.ndarray = masks_in(given, env.action_space, count=1)[0]
    except ValueError as error:
        inner = env.unwrapped
        name = inner.spec.id if inner.spec else type(inner).__name__
        raise ConfigurationError(
            f"environment.id: {name}: {ACTION_MASKS}(self): {error}; fix the environment"
        ) from error
    return mask


def allows(mask: np.ndarray, space: spaces.Space[Any], action: Any) -> bool:
    """Return whether a mask for this space allows the action."""
    chosen = np.asarray(action).ravel().astype(np.int64)
    return all(bool(part[at]) for part, at in zip(_parts(mask, choices_of(space)), chosen, strict=True))


def _parts(mask: np.ndarray, choices: list[int]) -> list[np.ndarray]:
    return np.split(mask, np.cumsum(choices)[:-1], axis=-1)


def _odd(mask: np.ndarray) -> Any:
    """Return the first value that is not a truth value, or the first value if all are truth values."""
    values = mask.ravel().tolist()
    return next((value for value in values if value not in (0, 1)), values[0])
