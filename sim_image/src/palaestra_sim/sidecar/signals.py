"""Receive the signals of the sidecar in a thread that only waits for signals.

All threads block these signals (`blocked_signals`), and one thread receives them with sigtimedwait. Handlers
would not work reliably. Python runs a handler in the main thread, so a signal that arrives just before the
main thread begins another wait would not interrupt the wait. The kernel drops signals without a handler that
are sent to process 1, but it does not drop blocked signals.
"""

import os
import signal
import threading
import time
from collections.abc import Callable

from palaestra_sim.sidecar.blocked_signals import ENDS, TAKEN
from palaestra_sim.sidecar.process import reap
from palaestra_sim.sidecar.reaper import adopt_orphans

SHUTDOWN_S = 1.8  # the sidecar exits within this time after the first signal, even if a simulator hangs
EXIT_HUNG = 1


def take(shut_down: Callable[[], None]) -> None:
    """From now on, reap children and handle SIGTERM and SIGINT, in a separate thread.

    The thread calls `shut_down` at the first SIGTERM or SIGINT. From now on, orphaned descendants become
    children of this process, even if this process is not process 1.
    """
    adopt_orphans()
    threading.Thread(target=_take, args=(shut_down,), name="signals", daemon=True).start()


def _take(shut_down: Callable[[], None]) -> None:
    while signal.sigwait(TAKEN) not in ENDS:
        reap()
    give_up = time.monotonic() + SHUTDOWN_S
    shut_down()
    while (left_s := give_up - time.monotonic()) > 0:
        signal.sigtimedwait(TAKEN, left_s)
        reap()
    os._exit(EXIT_HUNG)  # the exit closes the pipe to the reaper, so the reaper kills all processes
