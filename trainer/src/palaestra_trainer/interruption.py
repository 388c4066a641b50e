"""Being asked to end: SIGTERM and SIGINT.

The first signal is noted, and the run ends at the next place where it looks: at
a boundary with a checkpoint, or while simulators start, when there is nothing
to save, without waiting for one to come up. Nothing is raised out of the
handler itself: it may run amid a lock's release. What is waited for meanwhile
is waited for `patience.LEFT_S` seconds more. A second signal ends the
process at once, and so does one that comes before the run listens.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import Any, Self

from palaestra_sim.protocol.status import ExitCode
from palaestra_trainer import patience
from palaestra_trainer.errors import TrainerError

SIGNALS = (signal.SIGTERM, signal.SIGINT)
HURRY = "a second signal ends at once"

Check = Callable[[], None]


def go_on() -> None:
    """Check nothing."""


class Interrupted(TrainerError):
    """A signal asked the run to end; it can go on later."""


@contextmanager
def leaving_when_asked() -> Iterator[None]:
    """Let a signal end the process at once as interrupted, wherever inside no `Interruption` listens.

    For the seconds of its imports: it would die of the signal, or as the first process of a container
    not notice it, though there is nothing to save yet.
    """
    before = {number: signal.signal(number, _leave) for number in SIGNALS}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _leave(number: int, frame: FrameType | None) -> None:
    del frame
    os.write(2, f"{signal.Signals(number).name}: ending; nothing was begun\n".encode())
    os._exit(ExitCode.INTERRUPTED)


class Interruption:
    """Listens to the signals while it is entered; only from the main thread.

    Attributes:
        requested: the signal that came; None so far.
    """

    def __init__(self) -> None:
        self.requested: signal.Signals | None = None
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> Self:
        """Begin to listen."""
        self._before = {number: signal.signal(number, self._note) for number in SIGNALS}
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Put back who listened before."""
        for number, before in self._before.items():
            signal.signal(number, before)
        patience.renew()

    def check(self) -> None:
        """Raise Interrupted if a signal has come."""
        if self.requested is not None:
            raise Interrupted(f"{self.requested.name} received")

    def _note(self, number: int, frame: FrameType | None) -> None:
        del frame
        self.requested = signal.Signals(number)
        patience.end()
        for later in SIGNALS:
            signal.signal(later, signal.SIG_DFL)
        # Not by a logger: this may run amid another line of it.
        os.write(2, f"{self.requested.name}: ending; {HURRY}\n".encode())
