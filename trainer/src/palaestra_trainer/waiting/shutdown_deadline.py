"""How long the run may still wait for simulators, all together, after a signal asked it to end.

Each call has its own deadline. But sixteen simulators of a run may hang, and the run has one grace period.
A signal handler limits the waits by setting a number; it raises nothing in the middle of a call.
"""

from __future__ import annotations

import math
import time

# The checkpoint needs half of the default grace period, and a pending call may last twice its deadline.
LEFT_S = 10.0


class _Limit:
    """The end of all waits of this process, on its monotonic clock."""

    at_s = math.inf


def end(after_s: float = LEFT_S) -> None:
    """Let no wait begin later than `after_s` seconds from now."""
    _Limit.at_s = time.monotonic() + after_s


def renew() -> None:
    """Remove the limit: each call waits for its own deadline again."""
    _Limit.at_s = math.inf


def is_over() -> bool:
    """Return whether the time for waits is over."""
    return time.monotonic() > _Limit.at_s
