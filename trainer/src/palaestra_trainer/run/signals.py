"""Handle SIGTERM and SIGINT.

The handler records the first signal, and the run ends at its next check for signals. During training, the run
then saves a checkpoint of the last boundary between rollouts. While simulators start, the run does not save a
checkpoint, because it has no progress yet. The handler does not raise an exception, because an exception in
the middle of a lock's release could leave the lock held. Waits may continue for `shutdown_deadline.LEFT_S`
seconds. A second signal ends the process at once, and so does a signal that arrives before the run listens.
After the run's end, while Python exits, signals are ignored. If SIGINT was ignored when the program started,
as in the background of a script, it stays ignored.
"""

from __future__ import annotations

import atexit
import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import Any, Self

from palaestra_protocol.pod.status import ExitCode
from palaestra_protocol.signals import obeyed
from palaestra_trainer.errors import TrainerError
from palaestra_trainer.waiting import shutdown_deadline

SIGNALS = (signal.SIGTERM, signal.SIGINT)
HURRY = "a second signal ends at once"


class Interrupted(TrainerError):
    """A signal interrupted the run, which can be resumed later."""


@contextmanager
def leaving_when_asked() -> Iterator[None]:
    """Let a signal end the process at once as interrupted, unless an `Interruption` listens.

    The context covers the seconds of imports, before the run has progress to save. Without the context, a
    signal would kill the process, or have no effect if the process is the first of a container. While Python
    exits, signals are ignored, because a signal would replace the exit code of the run.
    """
    atexit.register(end_undisturbed)
    before = {number: signal.signal(number, _leave) for number in obeyed(SIGNALS)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def end_undisturbed() -> None:
    """Ignore the signals from now on, because the run has ended."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


def _leave(number: int, frame: FrameType | None) -> None:
    del frame
    os.write(2, f"{signal.Signals(number).name}: ending; nothing was started\n".encode())
    os._exit(ExitCode.INTERRUPTED)


class Interruption:
    """A context manager that listens to the signals; use it only in the main thread.

    Attributes:
        requested: the signal that arrived; None before a signal arrives.
    """

    def __init__(self) -> None:
        self.requested: signal.Signals | None = None
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> Self:
        """Install the signal handlers."""
        self._before = {number: signal.signal(number, self._note) for number in obeyed(SIGNALS)}
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Restore the previous handlers."""
        for number, before in self._before.items():
            signal.signal(number, before)
        shutdown_deadline.renew()

    def check(self) -> None:
        """Raise Interrupted if a signal has arrived."""
        if self.requested is not None:
            raise Interrupted(f"{self.requested.name} received")

    def _note(self, number: int, frame: FrameType | None) -> None:
        del frame
        self.requested = signal.Signals(number)
        shutdown_deadline.end()
        for later in self._before:
            signal.signal(later, signal.SIG_DFL)
        # The handler does not use a logger, because it may run while the logger writes a line.
        os.write(2, f"{self.requested.name}: ending; {HURRY}\n".encode())
