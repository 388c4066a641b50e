"""The signals that the sidecar blocks before it does anything else; `signals` receives them."""

import signal

ENDS = frozenset({signal.SIGTERM, signal.SIGINT})
TAKEN = ENDS | {signal.SIGCHLD}


def hold_back() -> None:
    """Block the signals, so that they stay pending until received; call this before another thread starts."""
    signal.pthread_sigmask(signal.SIG_BLOCK, TAKEN)
