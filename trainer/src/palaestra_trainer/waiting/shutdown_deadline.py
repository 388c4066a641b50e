"""A common deadline for all waits for simulators, after a signal requested the end of the run.

Each call has its own deadline. But if all sixteen simulators of a run hang, these deadlines together exceed
the grace period of the pod. The signal handler only sets this deadline as a number, so it does not raise in
the middle of a call.
"""

from __future__ import annotations

import math
import time

# Seconds for further waits. The rest of the default grace period is for the checkpoint, which needs half of
# the period, and for a pending call, which may last twice its deadline.
LEFT_S = 10.0


class _Limit:
    """The time, on the monotonic clock, after which no wait of this process may begin."""

    at_s = math.inf


def end(after_s: float = LEFT_S) -> None:
    """Set the deadline: no wait may begin later than `after_s` seconds from now."""
    _Limit.at_s = time.monotonic() + after_s


def renew() -> None:
    """Remove the deadline, so that each call waits until its own deadline again."""
    _Limit.at_s = math.inf


def is_over() -> bool:
    """Return whether the time for waits is over."""
    return time.monotonic() > _Limit.at_s
