"""Waiting for a condition by polling."""

import time
from collections.abc import Callable
from typing import Any

DEADLINE_S = 30.0
PACE_S = 0.05  # a shorter pace would load an API server that is polled


class TooLate(AssertionError):
    """The awaited condition did not become true before the deadline."""


def eventually(seen: Callable[[], Any], deadline_s: float = DEADLINE_S, pace_s: float = PACE_S) -> Any:
    """Return the first true value of `seen`, which is called every `pace_s`.

    Raises:
        TooLate: `seen` returned no true value within `deadline_s`.
    """
    ends = time.monotonic() + deadline_s
    while not (found := seen()):
        if time.monotonic() > ends:
            raise TooLate(f"not within {deadline_s} s; last seen: {found!r}")
        time.sleep(pace_s)
    return found
