"""End a run that makes no progress.

The watchdog has its own thread, because other threads may hang.
"""

from __future__ import annotations

import faulthandler
import os
import sys
import threading
from collections.abc import Callable
from types import TracebackType
from typing import Self

import structlog

from palaestra_protocol.pod.status import ExitCode
from palaestra_trainer.run.telemetry.progress import Progress
from palaestra_trainer.run.termination import End

log = structlog.get_logger(__name__)


class Watchdog:
    """A context manager that ends the process if `idle_s()` reaches `deadline_s` inside the context.

    Args:
        idle_s: a function that returns the seconds since the last progress.
        deadline_s: the longest time without progress.
        last_word: a function that writes the termination message, called before the process ends.
        leave: a function that ends the process with an exit code.
    """

    def __init__(
        self,
        idle_s: Callable[[], float],
        deadline_s: float,
        last_word: Callable[[], None],
        leave: Callable[[int], object] = os._exit,
    ) -> None:
        self._idle_s = idle_s
        self._deadline_s = deadline_s
        self._last_word = last_word
        self._leave = leave
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="watchdog", daemon=True)

    def __enter__(self) -> Self:
        """Start the thread of the watchdog."""
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Stop the thread of the watchdog."""
        self._over.set()

    def _watch(self) -> None:
        while not self._over.wait(min(self._deadline_s / 4, 5.0)):
            if self._idle_s() >= self._deadline_s:
                log.error("stalled: no environment step", seconds=round(self._idle_s(), 1))
                faulthandler.dump_traceback(sys.__stderr__ or 2, all_threads=True)
                self._last_word()
                self._leave(ExitCode.STALLED)
                return


def stalled(progress: Progress) -> End:
    """Return the end of a run that made no step within the deadline; this function never blocks."""
    fact = f"no environment step for {progress.idle_s():.0f} s while {progress.phase}"
    if down := progress.down():
        return End(ExitCode.STALLED, "SimulatorHung", f"{fact}; not ready: {', '.join(down)}")
    if progress.awaits_simulators:
        return End(ExitCode.STALLED, "SimulatorHung", f"{fact}; a simulator's step does not end")
    return End(ExitCode.STALLED, "Stalled", fact)
