"""One deadline for all waits for simulators after a signal asked the run to end.

Each call has its own deadline, but sixteen simulators of a run may hang, and the run has only one grace
period. A signal handler sets the deadline as a number; it does not raise in the middle of a call.
"""

from __future__ import annotations

import math
import time

# The checkpoint needs half of the default grace period, and a pending call may last twice its deadline.
LEFT_S = 10.0


class _Limit:
    """The time after which no wait of this process may begin, on its monotonic clock."""

    at_s = math.inf


def end(after_s: float = LEFT_S) -> None:
    """Set the deadline: no wait may begin later than `after_s` seconds from now."""
    _Limit.at_s = time.monotonic() + after_s


def renew() -> None:
    """Remove the deadline: each call waits for its own deadline again."""
    _Limit.at_s = math.inf


def is_over() -> bool:
    """Return whether the time for waits is over."""
    return time.monotonic() > _Limit.at_s
