"""Handle SIGTERM and SIGINT.

The first signal is recorded, and the run ends at its next check for signals.
During training it then saves a checkpoint of the last rollout boundary. While
simulators start, it saves no checkpoint, because there is nothing to save. The
handler itself raises nothing, because it may run while a lock is released.
Waits may continue for `shutdown_deadline.LEFT_S` seconds. A second signal ends
the process at once, and so does a signal that arrives before the run listens.
After the run's end, while Python exits, signals are ignored. A SIGINT that was
ignored when the program started, as in the background of a script, stays
ignored.
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
    """A signal interrupted the run; it can be resumed later."""


@contextmanager
def leaving_when_asked() -> Iterator[None]:
    """Let a signal end the process at once as interrupted, except while an `Interruption` listens.

    It covers the seconds of imports, when there is nothing to save yet. Without it the signal would kill the
    process, or have no effect if the process is the first of a container. While Python exits, a signal has no
    effect, because it would replace the exit code of the run.
    """
    atexit.register(end_undisturbed)
    before = {number: signal.signal(number, _leave) for number in obeyed(SIGNALS)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def end_undisturbed() -> None:
    """Ignore the signals from now on, because the end of the run is decided."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


def _leave(number: int, frame: FrameType | None) -> None:
    del frame
    os.write(2, f"{signal.Signals(number).name}: ending; nothing was started\n".encode())
    os._exit(ExitCode.INTERRUPTED)


class Interruption:
    """Listens to the signals while it is entered; use it only in the main thread.

    Attributes:
        requested: the signal that arrived; None until then.
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
        # A logger is not used here, because the handler may run while the logger writes a line.
        os.write(2, f"{self.requested.name}: ending; {HURRY}\n".encode())
