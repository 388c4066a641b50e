"""Block the signals that the sidecar will handle; the module `signals` receives them later."""

import signal

ENDS = frozenset({signal.SIGTERM, signal.SIGINT})
TAKEN = ENDS | {signal.SIGCHLD}


def hold_back() -> None:
    """Block the signals, so that they stay pending until a thread receives them.

    Call this function before any other thread starts, because new threads inherit the blocked signals.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, TAKEN)
