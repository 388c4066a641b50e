"""Several simulators in one thread: while one of them computes a step, the others get their turn.

A step of an environment is one function that sends, waits and reads. So that the waits of many
environments fall together, each step runs in a greenlet of its own, and gives up its turn between
asking its simulator for something long and awaiting the answer: `take_turns` runs them, `let_others` is
where a turn may end. A simulator that was asked first is read first, while the others still compute.
Threads did the same at twice the processor time: see docs/decisions/0006-turns-instead-of-threads.md.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable
from typing import Any

from greenlet import getcurrent, greenlet


class _Turn(greenlet):
    """One work of `take_turns`, and the seconds that it has spent in others' turns."""

    away_s = 0.0


def let_others() -> None:
    """Let the others of `take_turns` go on first; alone, this does nothing."""
    turn = getcurrent()
    if isinstance(turn, _Turn) and turn.parent is not None:
        left = time.perf_counter()
        turn.parent.switch()
        turn.away_s += time.perf_counter() - left


def away_s() -> float:
    """Return the seconds that the work whose turn it is has spent in others' turns, so far."""
    turn = getcurrent()
    return turn.away_s if isinstance(turn, _Turn) else 0.0


def take_turns(works: Iterable[Callable[[], Any]]) -> list[Any]:
    """Return what `works` return, in their order; each runs until it lets others, then the next.

    All of them are finished before the first error is raised, so that none is left in the middle.

    Raises:
        Exception: the first one of a work.
        BaseException: from the work whose turn it is, at once; the others are ended where they stand.
    """
    results: list[Any] = []
    errors: list[Exception] = []

    def run(place: int, work: Callable[[], Any]) -> None:
        try:
            results[place] = work()
        except Exception as error:  # noqa: BLE001 - raised below, when no work is left in the middle
            errors.append(error)

    waiting: deque[_Turn] = deque()
    for place, work in enumerate(works):
        results.append(None)
        waiting.append(_Turn(lambda place=place, work=work: run(place, work)))
    try:
        while waiting:
            turn = waiting.popleft()
            turn.switch()
            if not turn.dead:
                waiting.append(turn)
    except BaseException:
        for turn in waiting:
            turn.throw()
        raise
    if errors:
        raise errors[0]
    return results
