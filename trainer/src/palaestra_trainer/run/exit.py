"""End the process in time, even if code of the job's author still runs.

Without this module, a complete run and its pod could stay alive forever. The cause could be a `close` method
that hangs, a thread that does not end, or an exit function that waits.
"""

from __future__ import annotations

import faulthandler
import os
import sys
import threading
from collections.abc import Callable

import structlog

log = structlog.get_logger(__name__)


def nothing() -> None:
    """Do nothing, as the default of `before`."""


def leave_after(
    seconds: float,
    code: int,
    before: Callable[[], None] = nothing,
    leave: Callable[[int], object] = os._exit,
) -> threading.Timer:
    """Start and return a timer that ends the process, unless the caller cancels it.

    Args:
        seconds: time from now until the process ends.
        code: the exit code.
        before: called before the process ends.
        leave: a function that ends the process with an exit code.
    """

    def end() -> None:
        others = [thread for thread in threading.enumerate() if not thread.daemon]
        names = [thread.name for thread in others if thread is not threading.main_thread()]
        log.warning("process ended while code of the job was running", after_s=seconds, threads=names)
        faulthandler.dump_traceback(sys.__stderr__ or 2, all_threads=True)
        before()
        leave(code)

    timer = threading.Timer(seconds, end)
    timer.name, timer.daemon = "leaving", True
    timer.start()
    return timer
