"""The signals of the sidecar, taken by one thread that waits for nothing else.

They are blocked everywhere and fetched with sigtimedwait. A handler would not do: Python runs handlers
in the main thread, and a signal that comes just before that thread begins to wait for something else
wakes nobody. Process 1 gets blocked signals too, though it has no handler for them.
"""

import os
import signal
import threading
import time
from collections.abc import Callable

from palaestra_sim.sidecar.keeper import adopt_orphans
from palaestra_sim.sidecar.process import reap

SHUTDOWN_S = 1.8  # this long after the first signal the sidecar ends, whatever hangs
EXIT_HUNG = 1

_ENDS = frozenset({signal.SIGTERM, signal.SIGINT})
_TAKEN = _ENDS | {signal.SIGCHLD}


def hold_back() -> None:
    """Keep signals until `take` takes them; to be called before there is a second thread."""
    signal.pthread_sigmask(signal.SIG_BLOCK, _TAKEN)


def take(shut_down: Callable[[], None]) -> None:
    """Reap children and obey SIGTERM and SIGINT from now on, in a thread of its own.

    `shut_down` is called at the first signal that asks for the end. Orphans of what this process
    started become its children, as if it were process 1.
    """
    adopt_orphans()
    threading.Thread(target=_take, args=(shut_down,), name="signals", daemon=True).start()


def _take(shut_down: Callable[[], None]) -> None:
    while signal.sigwait(_TAKEN) not in _ENDS:
        reap()
    give_up = time.monotonic() + SHUTDOWN_S
    shut_down()
    while (left_s := give_up - time.monotonic()) > 0:
        signal.sigtimedwait(_TAKEN, left_s)
        reap()
    os._exit(EXIT_HUNG)  # the keeper sees the end of its pipe, and ends the rest
