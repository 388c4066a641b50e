"""Permit motion only while a person holds a key in the terminal.

A terminal reports no release of a key. It repeats a held key instead, after a first pause of up to 0.7 s. So
the second report of a key permits motion, and the next pause without a report ends the permission.
"""

from __future__ import annotations

import os
import select
import sys
import termios
import threading
import time
import tty
from dataclasses import dataclass
from typing import Any, Final, Self

from palaestra_trainer.errors import ConfigurationError

_FIRST_PAUSE_S: Final = 0.8  # the longest usual pause before a terminal repeats a key
_PAUSE_S: Final = 0.25  # a terminal repeats a key 10 to 30 times a second


@dataclass(slots=True)
class KeyPresses:
    """Decides from the times of key reports whether a key is held.

    Attributes:
        last_s: time of the newest report; None before the first one.
        repeats: whether that report followed another one closely enough.
    """

    last_s: float | None = None
    repeats: bool = False

    def report(self, at_s: float) -> None:
        """Take the report of a key at a time."""
        longest = _PAUSE_S if self.repeats else _FIRST_PAUSE_S
        self.repeats = self.last_s is not None and at_s - self.last_s <= longest
        self.last_s = at_s

    def held(self, now_s: float) -> bool:
        """Return whether a key is held at a time."""
        return self.repeats and self.last_s is not None and now_s - self.last_s <= _PAUSE_S


class HoldKey:
    """Reads keys of the terminal without echo, as a context manager, which restores the terminal at its end.

    Outside of the context, no key counts as held.

    Raises:
        ConfigurationError: standard input is not a terminal.
    """

    def __init__(self) -> None:
        if not sys.stdin.isatty():
            raise ConfigurationError(
                "standard input is not a terminal, so no key can be held; run this in a terminal, or drive "
                "without a key with --no-hold"
            )
        self._presses = KeyPresses()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._read, name="hold-key", daemon=True)
        self._before: list[Any] = []

    def __enter__(self) -> Self:
        """Begin to read keys."""
        self._before = termios.tcgetattr(sys.stdin)
        tty.setcbreak(sys.stdin)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Restore the terminal."""
        self._over.set()
        self._thread.join(1.0)
        termios.tcflush(sys.stdin, termios.TCIFLUSH)
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, self._before)

    def held(self) -> bool:
        """Return whether a key is held now."""
        return self._presses.held(time.monotonic())

    def _read(self) -> None:
        while not self._over.is_set():
            if select.select([sys.stdin], [], [], 0.1)[0]:
                if not os.read(sys.stdin.fileno(), 64):
                    return  # the terminal is gone, so no key is held
                self._presses.report(time.monotonic())
