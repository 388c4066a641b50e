"""How long simulators may still be waited for, all together, once the run is asked to end.

Each call has a deadline of its own, but a run may have sixteen simulators that hang, and its grace period
is one. A signal handler lets patience end: a number is set, and nothing is raised amid a call.
"""

from __future__ import annotations

import math
import time

# Half of the default grace period is the checkpoint's, and a call under way may last its deadline twice.
LEFT_S = 10.0

_over_at = math.inf


def end(after_s: float = LEFT_S) -> None:
    """Let no wait begin after so many seconds from now."""
    global _over_at  # noqa: PLW0603 - one process has one end
    _over_at = time.monotonic() + after_s


def renew() -> None:
    """Wait as long as each call's deadline says."""
    global _over_at  # noqa: PLW0603 - as above
    _over_at = math.inf


def is_over() -> bool:
    """Return whether answers that are not there yet are not to be waited for."""
    return time.monotonic() > _over_at
