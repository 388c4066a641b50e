"""Step several simulators in one thread; while a simulator computes, the thread serves the others.

A step of an environment is one function that sends, waits and reads. Each step runs in its own greenlet, so
the waits of many environments overlap. After a greenlet has sent a long request to its simulator, it lets the
other greenlets run before it waits for the response. `take_turns` runs the greenlets, and a greenlet's turn
ends only in `let_others`. The response of one simulator is read while the other simulators still compute.
A single work needs no greenlet, unless its caller runs in a turn itself.
Threads need more processor time, see docs/decisions/0006-turns-instead-of-threads.md.
"""

from __future__ import annotations

import select
import threading
import time
from collections.abc import Callable, Iterable
from typing import Any, Protocol

from greenlet import getcurrent, greenlet

from palaestra_trainer.waiting import shutdown_deadline
from palaestra_trainer.waiting.wait_time import count_wait

# If no response has arrived after this time, only the first greenlet waits, with its own deadline, so a fault
# is attributed to the right simulator. The time of that wait counts as a turn of this greenlet. So `_SOON_MS`
# is longer than a step, but short compared with the deadline.
_SOON_MS = 500


class PendingResponse(Protocol):
    """An object whose descriptor becomes readable when a response arrives."""

    def fileno(self) -> int:
        """Return the descriptor to watch."""
        ...


class _Turn(greenlet):
    """A greenlet that does works of `take_turns`; it is reused, because a new greenlet maps memory.

    Attributes:
        work: the current work, or the last work.
        done: whether the work has finished.
        result: the return value of `work`.
        failure: the exception that `work` raised; None: it did not raise.
        away_s: seconds that the turns of other greenlets took during this work, without the time in which all
            wait.
        until: descriptor of the response for which this greenlet waits; None: it can run.
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
        """Prepare this greenlet to do `work` for the caller; return it."""
        self.parent = getcurrent()
        self.work = work
        self.done = False
        self.away_s = 0.0
        self.until = None
        return self

    def end(self) -> tuple[Any, Exception | None]:
        """Return the result and the failure of the work, and drop the references to both."""
        ended = self.result, self.failure
        self.work = self.result = self.failure = None
        return ended

    def _do_works(self) -> None:
        """Call `work`, switch to the parent, and repeat both after each switch back."""
        while self.work is not None and self.parent is not None:
            try:
                self.result = self.work()
            except Exception as error:  # noqa: BLE001 - take_turns raises it after all works have ended
                self.failure = error
            self.done = True
            self.parent.switch()


class _Idle(threading.local):
    """The greenlets of this thread that have no work."""

    def __init__(self) -> None:
        self.turns: list[_Turn] = []


_idle = _Idle()


def let_others(until: PendingResponse | None = None) -> None:
    """Let the other works of `take_turns` run first; without other works, do nothing.

    Args:
        until: the other works may run until its descriptor is readable; None: each other work runs once.
    """
    turn = getcurrent()
    if isinstance(turn, _Turn) and turn.parent is not None:
        turn.until = None if until is None else until.fileno()
        left = time.perf_counter()
        turn.parent.switch()
        turn.away_s += time.perf_counter() - left


def away_s() -> float:
    """Return the seconds that other greenlets' turns have taken so far during the current work."""
    turn = getcurrent()
    return turn.away_s if isinstance(turn, _Turn) else 0.0


def take_turns(works: Iterable[Callable[[], Any]]) -> list[Any]:
    """Run `works` in turns that end in `let_others`; return their results in order.

    All works finish before the first error is raised, so no work stays incomplete.

    Raises:
        Exception: the error of the first failed work in the order of `works`.
        BaseException: the error of the current work, for example after Ctrl-C; the other works are stopped at
            once.
    """
    works = list(works)
    if len(works) == 1 and not isinstance(getcurrent(), _Turn):
        return [works[0]()]  # `let_others` then returns at once, and no greenlet's stack is copied
    turns = [(_idle.turns.pop() if _idle.turns else _Turn()).begin(work) for work in works]
    waiting = turns
    try:
        while waiting:
            for turn in _ready(waiting):
                turn.switch()
            waiting = [turn for turn in waiting if not turn.done]
    except BaseException:  # for Ctrl-C too, because no work may continue in a later call
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


class OpenWorks:
    """Works that take turns, and of which some may stay open while the caller does something else.

    Each work has a key. All methods must be called by the same thread.
    """

    def __init__(self) -> None:
        self._open: dict[int, _Turn] = {}
        self._ended: dict[int, _Turn] = {}

    def begin(self, key: int, work: Callable[[], Any]) -> None:
        """Begin a work at the next `run`, unless a work with this key is open or its result is not taken."""
        if key not in self._open and key not in self._ended:
            self._open[key] = (_idle.turns.pop() if _idle.turns else _Turn()).begin(work)

    def run(self, enough: Callable[[Any], bool]) -> None:
        """Run the works in turns until `enough` holds for a result, a work has failed, or all have ended.

        Each open work has at least one turn if it does not wait for a response.

        Raises:
            BaseException: the error of the current work, for example after Ctrl-C; the other works are
                stopped at once.
        """
        is_enough = self._has(enough)
        try:
            while self._open:
                for turn in _ready([*self._open.values()], wait=not is_enough):
                    turn.switch()
                self._ended |= {key: turn for key, turn in self._open.items() if turn.done}
                self._open = {key: turn for key, turn in self._open.items() if not turn.done}
                if is_enough := is_enough or self._has(enough):
                    break
        except BaseException:  # for Ctrl-C too, because no work may continue in a later call
            self.abort()
            raise

    def take(self) -> dict[int, Any]:
        """Return the results of the ended works by key, and forget them.

        Raises:
            Exception: the error of the failed work with the lowest key.
        """
        ended = {key: turn.end() for key, turn in sorted(self._ended.items())}
        _idle.turns += self._ended.values()
        self._ended = {}
        for _, failure in ended.values():
            if failure is not None:
                raise failure
        return {key: result for key, (result, _) in ended.items()}

    def abort(self) -> None:
        """Stop all open works where they are, and forget all results."""
        for turn in self._open.values():
            if not turn.dead:
                turn.throw()
        self._open, self._ended = {}, {}

    def _has(self, enough: Callable[[Any], bool]) -> bool:
        return any(turn.failure is not None or enough(turn.result) for turn in self._ended.values())


def _ready(turns: list[_Turn], *, wait: bool = True) -> list[_Turn]:
    """Return the greenlets that can run, in their order.

    If all of them wait for responses and `wait` is true, wait for a response; return at least one greenlet.
    """
    awaited = [turn.until for turn in turns if turn.until is not None]
    if not awaited or (wait and len(turns) == 1):
        return turns
    answers = select.poll()
    for file in awaited:
        answers.register(file, select.POLLIN)
    nobody_can_go_on = wait and len(awaited) == len(turns) and not shutdown_deadline.is_over()
    began = time.perf_counter()
    come = {file for file, _ in answers.poll(_SOON_MS if nobody_can_go_on else 0)}
    waited_s = time.perf_counter() - began
    count_wait(waited_s)
    for turn in turns:
        turn.away_s -= waited_s
    ready = [turn for turn in turns if turn.until is None or turn.until in come]
    return ready or (turns[:1] if wait else [])
