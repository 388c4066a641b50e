"""Several simulators in one thread: while one of them computes a step, the others get their turn.

A step of an environment is one function that sends, waits and reads. So that the waits of many
environments fall together, each step runs in a greenlet of its own, and gives up its turn between
asking its simulator for something long and awaiting the answer: `take_turns` runs them, `let_others` is
where a turn may end. A simulator that has answered is read while the others still compute.
Threads did the same at twice the processor time: see docs/decisions/0006-turns-instead-of-threads.md.
"""

from __future__ import annotations

import select
import threading
import time
from collections.abc import Callable, Iterable
from typing import Any, Protocol

from greenlet import getcurrent, greenlet

from palaestra_trainer import patience
from palaestra_trainer.waits import count_wait

# After this whoever was asked first waits by itself: deadlines, and whose fault it is, are its own business.
# Longer than a step takes, since that wait counts as its turn; short beside a deadline, which begins then.
_SOON_MS = 500


class Answer(Protocol):
    """What can be read once an answer has come."""

    def fileno(self) -> int:
        """Return the descriptor to be watched."""
        ...


class _Turn(greenlet):
    """One work of `take_turns` after another: for each new greenlet Python maps memory, and unmaps it later.

    Attributes:
        work: what it does, or has done.
        done: whether it has finished.
        result: what `work` has returned.
        failure: what it has raised instead.
        away_s: seconds that it has spent in others' turns; those in which all wait are nobody's turn.
        until: the descriptor of the answer that it waits for; None: it can go on.
    """

    def __init__(self) -> None:
        super().__init__(self._do_works)
        self.work: Callable[[], Any] | None = None
        self.done = False
        self.result: Any = None
        self.failure: Exception | None = None
        self.away_s = 0.0
        self.until: int | None = None

    def begin(self, work: Callable[[], Any]) -> _Turn:
        """Return this turn, ready to do `work` for the caller."""
        self.parent = getcurrent()
        self.work = work
        self.done = False
        self.away_s = 0.0
        self.until = None
        return self

    def end(self) -> tuple[Any, Exception | None]:
        """Return what came of the work, and keep nothing of it."""
        ended = self.result, self.failure
        self.work = self.result = self.failure = None
        return ended

    def _do_works(self) -> None:
        """Do one work, then, when it is switched to again, the next."""
        while self.work is not None and self.parent is not None:
            try:
                self.result = self.work()
            except Exception as error:  # noqa: BLE001 - raised by `take_turns`, when no work is left in the middle
                self.failure = error
            self.done = True
            self.parent.switch()


class _Idle(threading.local):
    """Turns of this thread that have nothing to do."""

    def __init__(self) -> None:
        self.turns: list[_Turn] = []


_idle = _Idle()


def let_others(until: Answer | None = None) -> None:
    """Let the others of `take_turns` go on first; alone, this does nothing.

    Args:
        until: they may go on until this can be read; by default once each.
    """
    turn = getcurrent()
    if isinstance(turn, _Turn) and turn.parent is not None:
        turn.until = None if until is None else until.fileno()
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
        Exception: of the first work, in their order, that failed.
        BaseException: from the work whose turn it is, at once; the others are ended where they stand.
    """
    turns = [(_idle.turns.pop() if _idle.turns else _Turn()).begin(work) for work in works]
    waiting = turns
    try:
        while waiting:
            for turn in _ready(waiting):
                turn.switch()
            waiting = [turn for turn in waiting if not turn.done]
    except BaseException:
        for turn in turns:
            if not turn.dead:
                turn.throw()
        raise
    ended = [turn.end() for turn in turns]
    _idle.turns += turns
    for _, failure in ended:
        if failure is not None:
            raise failure
    return [result for result, _ in ended]


def _ready(turns: list[_Turn]) -> list[_Turn]:
    """Return those who can go on, one at least, in their order; wait if all of them do."""
    awaited = [turn.until for turn in turns if turn.until is not None]
    if not awaited or len(turns) == 1:
        return turns
    answers = select.poll()
    for file in awaited:
        answers.register(file, select.POLLIN)
    nobody_can_go_on = len(awaited) == len(turns) and not patience.is_over()
    began = time.perf_counter()
    come = {file for file, _ in answers.poll(_SOON_MS if nobody_can_go_on else 0)}
    waited_s = time.perf_counter() - began
    count_wait(waited_s)
    for turn in turns:
        turn.away_s -= waited_s
    return [turn for turn in turns if turn.until is None or turn.until in come] or turns[:1]
