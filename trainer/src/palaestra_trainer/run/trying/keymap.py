"""Map keys of a terminal to actions, without input or output."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium import spaces

from palaestra_trainer.errors import ConfigurationError

UP, DOWN, LEFT, RIGHT, SPACE, NEXT, QUIT = "up", "down", "left", "right", "space", "n", "q"
_MOST_ACTIONS, _MOST_NUMBERS = 10, 3
_ESCAPED = {b"A": UP, b"B": DOWN, b"C": RIGHT, b"D": LEFT}
_PLAIN = {b" ": SPACE, b"\x04": QUIT}
_NAMED = {UP: "forward", DOWN: "backward", LEFT: "left", RIGHT: "right", SPACE: "stop"}
# The keys assume that the first number of an action moves the robot ahead, and the second number to the left.
_AXES = ((UP, DOWN), (LEFT, RIGHT), ("a", "d"))

Keys = Mapping[str, Any]


def keys_of(space: spaces.Space[Any], names: Sequence[str] = ()) -> Keys:
    """Return the action of each key.

    Args:
        space: the space of the actions.
        names: names of the actions of a Discrete space; empty if the names are unknown.

    Raises:
        ConfigurationError: a person cannot choose among these actions with a few keys.
    """
    match space:
        case spaces.Discrete() if int(space.n) <= _MOST_ACTIONS:
            return _of_choices(space, names)
        case spaces.Box() if len(space.shape) == 1 and space.shape[0] <= _MOST_NUMBERS and _bounded(space):
            return _of_numbers(space)
        case _:
            raise ConfigurationError(
                f"--agent keyboard: the actions are {space}, but keys can choose only among at most "
                f"{_MOST_ACTIONS} actions of a Discrete space or {_MOST_NUMBERS} bounded numbers; use "
                "--agent random"
            )


def legend(keys: Keys, names: Sequence[str] = ()) -> str:
    """Return a line of text with the keys and their actions."""
    told = ", ".join(f"{key}: {_told(action, names)}" for key, action in keys.items())
    return f"keys: {told}; {NEXT}: next episode, {QUIT}: end; each key is one step"


def decode(typed: bytes) -> tuple[list[str], bytes]:
    """Return the keys in the bytes of a terminal, and the bytes of an incomplete last key."""
    keys: list[str] = []
    while typed:
        if typed[:1] == b"\x1b":
            if typed in (b"\x1b", b"\x1b[", b"\x1bO"):
                return keys, typed
            if typed[1:2] in (b"[", b"O"):
                keys += [_ESCAPED[typed[2:3]]] if typed[2:3] in _ESCAPED else []
                typed = typed[3:]
                continue
        keys.append(_PLAIN.get(typed[:1], typed[:1].decode("ascii", "replace").lower()))
        typed = typed[1:]
    return keys, b""


def _of_choices(space: Any, names: Sequence[str]) -> Keys:
    make = space.dtype.type
    numbered = {str(number): make(space.start + number) for number in range(int(space.n))}
    if names:
        arrows = {key: names.index(name) for key, name in _NAMED.items() if name in names}
    else:
        arrows = dict(zip((UP, LEFT, RIGHT, DOWN), range(int(space.n)), strict=False))
    return {key: make(space.start + number) for key, number in arrows.items()} | numbered


def _of_numbers(space: spaces.Box) -> Keys:
    zero = np.clip(np.zeros(space.shape, space.dtype), space.low, space.high)
    keys: dict[str, Any] = {SPACE: zero}
    for number, (more, less) in zip(range(space.shape[0]), _AXES, strict=False):
        for key, bound in ((more, space.high), (less, space.low)):
            keys[key] = zero.copy()
            keys[key][number] = bound[number]
    return keys


def _bounded(space: spaces.Box) -> bool:
    return bool(np.isfinite(space.low).all() and np.isfinite(space.high).all())


def _told(action: Any, names: Sequence[str]) -> str:
    if isinstance(action, np.ndarray):
        return "[" + ", ".join(f"{number:g}" for number in action.tolist()) + "]"
    return names[int(action)] if int(action) < len(names) else f"action {int(action)}"
