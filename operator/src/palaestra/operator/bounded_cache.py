"""Bounded memory, by TrainingJob, for facts that no watch reports.

Each reconcile of a job replaces the values that the previous reconcile stored. The values of a deleted or
recreated TrainingJob are dropped, so the memory holds only facts about existing objects. A full memory
accepts a new value only after another value was dropped. The memory does not evict the oldest value.
Otherwise, with thousands of jobs, each job would evict the values of another job, and no value would stay.

A `RateLimitedLookup` also sends the requests for the facts. The facts are about incomplete objects, which
lack a pod, a volume, an admission or a cause. The lookup sends the first request about an object some seconds
after the object was found incomplete. The pauses between the later requests grow. All objects of one lookup
share a few requests a second, so that thousands of objects in one namespace do not delay other namespaces.
"""

import threading
import time
from collections.abc import Callable, Collection, Hashable, Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

from palaestra.objects import Key

REMEMBERED = 4000  # limit of objects of all jobs together; one message is stored for each object
PATIENCE_S = 5.0  # seconds from the first look at an incomplete object to the first request about the object
# The pause between the first two requests about an object; each later pause is twice the previous one.
RECHECK_S = 15.0
LONGEST_PAUSE_S = 300.0
# Requests a second for all objects together. The bucket holds one token, so at most 5 requests are sent in
# any second.
RATE = 4.0

Item = TypeVar("Item", bound=Hashable)
Value = TypeVar("Value")
Fact = TypeVar("Fact")
Ask = Callable[[str, Item], Fact | None]


class BoundedCache(Generic[Item, Value]):
    """Values by TrainingJob and item.

    Several threads may use one cache, but only one at a time may use the values of one TrainingJob.
    """

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._values: dict[Key, tuple[str, Mapping[Item, Value]]] = {}
        self._size = 0

    def known(self, key: Key, uid: str) -> Mapping[Item, Value]:
        """Return the values of a TrainingJob."""
        with self._lock:
            known_uid, values = self._values.get(key, (uid, {}))
            if known_uid == uid:
                return values
            self.forget(key)
            return {}

    def keep(self, key: Key, uid: str, values: Mapping[Item, Value]) -> Mapping[Item, Value]:
        """Replace the values of a TrainingJob by `values`; return the values that fit into the memory.

        If not all values fit, items that were already stored come before new items.
        """
        with self._lock:
            before = self.known(key, uid)
            self.forget(key)
            ordered = sorted(values, key=lambda item: item not in before)
            kept = {item: values[item] for item in ordered[: REMEMBERED - self._size]}
            if kept:
                self._values[key] = uid, kept
                self._size += len(kept)
            return kept

    def forget(self, key: Key) -> None:
        """Drop the values of a deleted TrainingJob."""
        with self._lock:
            _, values = self._values.pop(key, ("", {}))
            self._size -= len(values)


@dataclass(frozen=True, slots=True, kw_only=True)
class Answers(Generic[Item, Fact]):
    """The facts about incomplete objects.

    Attributes:
        facts: the last fact about each object; an object without a fact is absent.
        unasked: objects that the full memory did not accept; the operator sends no request about them.
        again_s: seconds until the next reconcile must send a request, or None if no object is incomplete.
    """

    facts: Mapping[Item, Fact]
    unasked: frozenset[Item] = frozenset()
    again_s: float | None = None


@dataclass(slots=True)
class _Lack(Generic[Fact]):
    """An incomplete object: the time of the next request about it, and the last fact."""

    due: float
    pause_s: float = RECHECK_S
    queued: bool = False
    fact: Fact | None = None


class RateLimitedLookup(BoundedCache[Item, _Lack[Fact]]):
    """The facts about incomplete objects, by TrainingJob and object.

    Args:
        ask: requests and returns the fact about an object of a namespace, or None.
        clock: a monotonic clock, in seconds.
    """

    def __init__(self, ask: Ask[Item, Fact], clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._ask = ask
        self._clock = clock
        self._turns = _Turns(clock())

    def about(self, key: Key, uid: str, lacking: Collection[Item]) -> Answers[Item, Fact]:
        """Return the facts about `lacking`, the incomplete objects of a TrainingJob.

        Raises:
            ApiError: a request failed; `about` sends the next one after a pause.
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
        """Return whether to send a request now; if so, start the pause after it."""
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
    """A rate limiter: a bucket of one token, and a queue of future times for objects that must wait."""

    def __init__(self, now: float) -> None:
        self._lock = threading.Lock()
        self._tokens, self._filled = 1.0, now
        self._end = now  # the first future time that is not assigned to a waiting object

    def wait_s(self, now: float, *, queued: bool) -> float:
        """Return the seconds until the request may be sent; 0: now.

        `queued`: the object has waited for a future time before.
        """
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
