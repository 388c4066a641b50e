"""Detect slow steps."""

from __future__ import annotations

from collections import deque

SLOW_TIMES = 10
SLOW_S = 0.05
_REMEMBERED = 100
_FEWEST = 10


class Pace:
    """The usual duration of one simulator's steps: the median of the last hundred."""

    def __init__(self) -> None:
        self._recent: deque[float] = deque(maxlen=_REMEMBERED)

    def slow(self, seconds: float) -> bool:
        """Return whether a step that took `seconds` was slow, and remember its duration.

        A step is slow if it takes more than 10 times the median and more than 50 ms. None of the first ten
        steps is slow.
        """
        slow = seconds > SLOW_S and len(self._recent) >= _FEWEST and seconds > SLOW_TIMES * self._median()
        self._recent.append(seconds)
        return slow

    def _median(self) -> float:
        return sorted(self._recent)[len(self._recent) // 2]
