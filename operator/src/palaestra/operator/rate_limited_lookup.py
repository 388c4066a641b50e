"""Ask the API server about objects that lack something: rarely, in turns, and about a limited number.

A watch would be expensive, and the answers are rarely needed. The first request about an object is sent after
it has lacked something for some seconds, the next ones at growing pauses. All objects of one
`RateLimitedLookup` share a few requests a second and a limited memory, so that thousands of them in a
namespace delay no others.
"""

import threading
import time
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

from palaestra.objects import Key
from palaestra.operator.bounded_cache import BoundedCache, Item

PATIENCE_S = 5.0  # before the first request about an object
RECHECK_S = 15.0  # between the first two requests about an object; each pause is twice the one before
LONGEST_PAUSE_S = 300.0
RATE = 4.0  # requests a second for all objects together; with one saved token, at most 5 in any second

Fact = TypeVar("Fact")
Ask = Callable[[str, Item], Fact | None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Answers(Generic[Item, Fact]):
    """The answers about objects that lack something.

    Attributes:
        facts: the last answer about each; an object without one is absent.
        unasked: objects for which there is no room; the operator sends no request about them.
        again_s: seconds until the next reconcile has to ask again; None: nothing is lacking.
    """

    facts: Mapping[Item, Fact]
    unasked: frozenset[Item] = frozenset()
    again_s: float | None = None


@dataclass(slots=True)
class _Lack(Generic[Fact]):
    """An object that lacks something: when to ask next, and the last answer."""

    due: float
    pause_s: float = RECHECK_S
    queued: bool = False
    fact: Fact | None = None


class RateLimitedLookup(BoundedCache[Item, _Lack[Fact]]):
    """The answers about objects that lack something, by TrainingJob and object.

    Args:
        ask: returns the answer about an object of a namespace; None: there is none.
        clock: a monotonic clock, in seconds.
    """

    def __init__(self, ask: Ask[Item, Fact], clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._ask = ask
        self._clock = clock
        self._turns = _Turns(clock())

    def about(self, key: Key, uid: str, lacking: Collection[Item]) -> Answers[Item, Fact]:
        """Return the answers about those objects of a TrainingJob that lack something.

        Raises:
            ApiError: a request got no answer; the next one follows after a pause.
        """
        known = self.known(key, uid)
        due = self._clock() + PATIENCE_S
        kept = self.keep(key, uid, {item: known.get(item) or _Lack(due) for item in lacking})
        for item, lack in kept.items():
            if self._is_due(lack):
                lack.fact = self._ask(key[0], item)
        unasked = frozenset(set(lacking) - kept.keys())
        waits_s = [max(lack.due - self._clock(), 0.0) for lack in kept.values()]
        return Answers(
            facts={item: lack.fact for item, lack in kept.items() if lack.fact is not None},
            unasked=unasked,
            again_s=min([*waits_s, *(LONGEST_PAUSE_S for _ in unasked)], default=None),
        )

    def _is_due(self, lack: _Lack[Fact]) -> bool:
        """Return whether to ask now; if so, start the pause after that."""
        now = self._clock()
        if now < lack.due:
            return False
        wait_s = self._turns.wait_s(now, queued=lack.queued)
        lack.queued = wait_s > 0
        lack.due = now + (wait_s or lack.pause_s)
        if not lack.queued:
            lack.pause_s = min(lack.pause_s * 2, LONGEST_PAUSE_S)
        return not lack.queued


class _Turns:
    """Limits the rate: one token, and a queue of moments for objects that must wait."""

    def __init__(self, now: float) -> None:
        self._lock = threading.Lock()
        self._tokens, self._filled = 1.0, now
        self._end = now  # of the queue

    def wait_s(self, now: float, *, queued: bool) -> float:
        """Return the seconds to wait for a turn; 0: the turn is now."""
        with self._lock:
            self._tokens = min(self._tokens + (now - self._filled) * RATE, 1.0)
            self._filled = now
            if not queued and now < self._end:
                wait_s = self._end - now
                self._end += 1 / RATE
                return wait_s
            if self._tokens < 1.0:
                return (1.0 - self._tokens) / RATE
            self._tokens = 0.0
            self._end = max(self._end, now + 1 / RATE)
            return 0.0
