"""Telling a slow step from an ordinary one."""

from __future__ import annotations

from bisect import bisect_left, insort
from collections import deque

SLOW_TIMES = 10
SLOW_S = 0.05
_REMEMBERED = 100
_FEWEST = 10


class Pace:
    """How long the steps of one simulator take: the median of the last hundred."""

    def __init__(self) -> None:
        self._recent: deque[float] = deque()
        self._ordered: list[float] = []

    def slow(self, seconds: float) -> bool:
        """Return whether a step that took `seconds` was slow, and remember it.

        Slow is what takes more than 10 times the median and more than 50 ms; nothing is before ten steps
        have been seen.
        """
        recent, ordered = self._recent, self._ordered
        slow = (
            seconds > SLOW_S and len(ordered) >= _FEWEST and seconds > SLOW_TIMES * ordered[len(ordered) // 2]
        )
        if len(recent) == _REMEMBERED:
            del ordered[bisect_left(ordered, recent.popleft())]
        recent.append(seconds)
        insort(ordered, seconds)
        return slow
