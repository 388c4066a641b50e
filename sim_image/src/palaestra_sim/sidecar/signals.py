"""The signals of the sidecar, received by one thread that only waits for signals.

They are blocked in all threads (`blocked_signals`) and received with sigtimedwait. A handler would not be
enough: Python runs handlers in the main thread, so a signal that arrives just before that thread blocks on
another wait does not wake it. Process 1 receives blocked signals too, although it has no handler for them.
"""

import os
import signal
import threading
import time
from collections.abc import Callable

from palaestra_sim.sidecar.blocked_signals import ENDS, TAKEN
from palaestra_sim.sidecar.process import reap
from palaestra_sim.sidecar.reaper import adopt_orphans

SHUTDOWN_S = 1.8  # the sidecar exits at most this long after the first signal, even if something hangs
EXIT_HUNG = 1


def take(shut_down: Callable[[], None]) -> None:
    """From now on, reap children and handle SIGTERM and SIGINT, in a separate thread.

    `shut_down` is called at the first SIGTERM or SIGINT. Orphaned descendants of this process become its
    children, as if it were process 1.
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
    os._exit(EXIT_HUNG)  # this closes the pipe to the reaper, which ends the remaining processes
