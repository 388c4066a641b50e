"""Ctrl-C: once asks the run to end with a checkpoint, twice ends it at once."""

import asyncio
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Stoppable(Protocol):
    """What can be asked to end, and ended."""

    def stop(self) -> None:
        """Begin to end."""

    def kill(self) -> None:
        """End at once."""


class Interrupt:
    """Counts the signals of a run and passes them to what runs now."""

    def __init__(self) -> None:
        self.asked = asyncio.Event()
        self.killed = False
        self._target: Stoppable | None = None

    def pass_to(self, target: Stoppable) -> None:
        """Choose what the next signals are for; one that came before is passed on now."""
        self._target = target
        if self.asked.is_set():
            target.stop()

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Take SIGINT, SIGTERM and SIGHUP while the block runs."""
        loop = asyncio.get_running_loop()
        for number in SIGNALS:
            loop.add_signal_handler(number, self._came)
        try:
            yield
        finally:
            for number in SIGNALS:
                loop.remove_signal_handler(number)

    def _came(self) -> None:
        again = self.asked.is_set()
        self.asked.set()
        self.killed = self.killed or again
        if self._target is not None:
            (self._target.kill if again else self._target.stop)()
