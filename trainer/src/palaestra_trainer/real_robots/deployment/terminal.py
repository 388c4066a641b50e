"""The person's terminal: a line of status, a question, and a key to hold."""

from __future__ import annotations

import select
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from palaestra_trainer.real_robots.deployment.hold_key import HoldKey
from palaestra_trainer.waiting.check import Check

_LOOK_S: Final = 0.1


class Terminal:
    """Shows the status in one line of a terminal, or in lines if the output is a file.

    Args:
        key: the key that a person holds while the robot drives; None: the robot drives without a key.
    """

    def __init__(self, key: HoldKey | None) -> None:
        self._key = key
        self._in_place = sys.stdout.isatty()
        self._open = False
        self._asked = False  # whether the person has been asked to hold the key

    def permits(self) -> bool:
        """Return whether the person permits motion now; True before `holding`, when only a dry run runs."""
        return self._key is None or not self._asked or self._key.held()

    @contextmanager
    def holding(self) -> Iterator[None]:
        """Read the key within this context."""
        if self._key is None:
            yield
            return
        self._asked = True
        self._write("hold the space bar to drive; release it to stop; Ctrl-C ends\n")
        with self._key:
            yield

    def show(self, line: str) -> None:
        """Show a line of status in place of the last one."""
        self._write(f"\r\x1b[K{line}" if self._in_place else f"{line}\n")
        self._open = self._in_place

    def end_line(self) -> None:
        """Keep the last line of status."""
        if self._open:
            self._write("\n")
            self._open = False

    def confirms(self, robot: str, check: Check) -> bool:
        """Ask the person whether the robot may drive, and return the decision.

        `check` is called often during the wait, and may raise to end it.
        """
        self._write(f"drive {robot}? Its emergency stop must be in reach. Type yes: ")
        while not select.select([sys.stdin], [], [], _LOOK_S)[0]:
            check()
        confirmed = sys.stdin.readline().strip() == "yes"
        check()
        return confirmed

    def _write(self, text: str) -> None:
        sys.stdout.write(text)
        sys.stdout.flush()
