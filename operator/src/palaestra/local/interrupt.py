"""End a run early: the first Ctrl-C or a deadline saves a checkpoint, and the second Ctrl-C kills.

A signal that was ignored when the program started stays ignored. Only SIGTERM always ends a run.
"""

import asyncio
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

from palaestra_protocol.signals import obeyed

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Stoppable(Protocol):
    """A program or pod that can be stopped and killed."""

    def stop(self) -> None:
        """Start the shutdown."""

    def kill(self) -> None:
        """Kill the target at once."""


class Interrupt:
    """Counts the signals to a run and passes them to the current target.

    `expired`: whether the deadline passed before any signal.
    """

    def __init__(self) -> None:
        self.asked = asyncio.Event()
        self.expired = False
        self.signals = 0
        self._target: Stoppable | None = None

    @property
    def killed(self) -> bool:
        """Return whether a second signal has arrived, which kills the run."""
        return self.signals > 1

    def pass_to(self, target: Stoppable) -> None:
        """Set the target of later signals; if a signal has arrived before, stop the target now."""
        self._target = target
        if self.asked.is_set():
            target.stop()

    @contextmanager
    def listening(self, deadline_s: float | None = None) -> Iterator[None]:
        """Handle signals while the block runs; stop the target at the deadline."""
        loop = asyncio.get_running_loop()
        numbers = obeyed(SIGNALS)
        timer = None if deadline_s is None else loop.call_later(deadline_s, self._expire)
        for number in numbers:
            loop.add_signal_handler(number, self._came)
        try:
            yield
        finally:
            for number in numbers:
                loop.remove_signal_handler(number)
            if timer is not None:
                timer.cancel()

    def _came(self) -> None:
        self.signals += 1
        self._end()

    def _expire(self) -> None:
        if not self.asked.is_set():
            self.expired = True
            self._end()

    def _end(self) -> None:
        self.asked.set()
        if self._target is not None:
            (self._target.kill if self.killed else self._target.stop)()
