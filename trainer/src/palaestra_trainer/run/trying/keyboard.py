"""Let a person drive with the keys of a terminal; each key is one step."""

from __future__ import annotations

import os
import select
import sys
import termios
import tty
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from palaestra_trainer.run.trying.agents import EndEpisode, EndTry
from palaestra_trainer.run.trying.keymap import NEXT, QUIT, Keys, decode
from palaestra_trainer.waiting.check import Check

_LOOK_EVERY_S = 0.1
_MOST_BYTES = 64


@contextmanager
def keys_at_once() -> Iterator[int]:
    """Make each key arrive at once; yield the terminal's descriptor; restore the terminal at the end."""
    descriptor = sys.stdin.fileno()
    before = termios.tcgetattr(descriptor)
    try:
        tty.setcbreak(descriptor)
        yield descriptor
    finally:
        termios.tcsetattr(descriptor, termios.TCSAFLUSH, before)


class KeyboardDriver:
    """Waits for a key that has an action, and returns this action; other keys have no effect.

    Args:
        terminal: descriptor of a terminal from which each key arrives at once.
        keys: the action of each key, by the name of the key.
        check: called every tenth of a second; it raises to end the wait.
        show: called with a line for each step.
    """

    def __init__(self, terminal: int, keys: Keys, check: Check, show: Callable[[str], None]) -> None:
        self._terminal = terminal
        self._keys = keys
        self._check = check
        self._show = show
        self._typed: deque[str] = deque()
        self._rest = b""

    def act(self, mask: np.ndarray | None) -> Any:
        """Return the action of the next key.

        Raises:
            EndEpisode, EndTry: the person pressed the key for the next episode or for the end, or closed the
                terminal.
        """
        del mask
        while True:
            key = self._next()
            if key == NEXT:
                raise EndEpisode
            if key == QUIT:
                raise EndTry
            if key in self._keys:
                return self._keys[key]

    def got(self, step: int, reward: float) -> None:
        """Show the reward to the person."""
        self._show(f"step {step}: reward {reward:.3f}")

    def _next(self) -> str:
        while not self._typed:
            self._check()
            if select.select([self._terminal], [], [], _LOOK_EVERY_S)[0]:
                read = os.read(self._terminal, _MOST_BYTES)
                if not read:
                    raise EndTry
                keys, self._rest = decode(self._rest + read)
                self._typed.extend(keys)
        return self._typed.popleft()
