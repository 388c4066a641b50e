"""The controller's queue of names of objects.

The queue has each name at most once, and two workers never have the same name at the same time.

If a name is added while a worker has it, `get` returns the name again after that worker is done. So no change
is missed, and two workers never work on one object. The queue contains names, not events: a worker reads the
current state of the object.

Each name is in a lane, and the lanes take turns. So a thousand names in one lane delay a name in another lane
only by the work in progress.
"""

import heapq
import itertools
import threading
import time
from collections import deque
from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

from palaestra.cluster.timeouts import Backoff

Item = TypeVar("Item", bound=Hashable)
RETRY = Backoff(first_s=0.1, cap_s=60.0)  # with jitter, the waits are from 0.05 s to 60 s


def _nobody(seconds: float) -> None:
    del seconds


def _one_lane(key: Hashable) -> Hashable:
    del key
    return None


class WorkQueue(Generic[Item]):
    """A deduplicating queue with delays; several threads may use one queue.

    Args:
        again: the waits before work on a name is retried.
        waited: called with the seconds that a name was ready before a worker took it.
        lane: returns the lane of a name.
        clock: a monotonic clock, in seconds.
    """

    def __init__(
        self,
        *,
        again: Backoff = RETRY,
        waited: Callable[[float], None] = _nobody,
        lane: Callable[[Item], Hashable] = _one_lane,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._again = again
        self._waited = waited
        self._lane = lane
        self._clock = clock
        self._changed = threading.Condition()
        # The ready keys of each lane. The first lane has the next turn.
        self._ready: dict[Hashable, deque[Item]] = {}
        # For each key that waits for a worker, the time at which the wait began. If a key is added while a
        # worker has it, the key waits too.
        self._since: dict[Item, float] = {}
        self._working: set[Item] = set()
        self._later: list[tuple[float, int, Item]] = []
        self._due: dict[Item, float] = {}
        self._failures: dict[Item, int] = {}
        self._order = itertools.count()  # orders entries of the same time
        self._closed = False

    @property
    def depth(self) -> int:
        """Return the number of names that are ready for a worker."""
        with self._changed:
            self._promote(self._clock())
            return sum(map(len, self._ready.values()))

    @property
    def closed(self) -> bool:
        """Return whether `close` was called; afterwards `get` returns None."""
        return self._closed

    def add(self, key: Item) -> None:
        """Queue a name for the next free worker."""
        with self._changed:
            self._add(key, self._clock())
            self._changed.notify_all()

    def add_after(self, key: Item, seconds: float) -> None:
        """Queue a name after `seconds`; after several such calls, the earliest time counts."""
        with self._changed:
            due = self._clock() + seconds
            if due < self._due.get(key, float("inf")):
                self._due[key] = due
                heapq.heappush(self._later, (due, next(self._order), key))
                self._changed.notify_all()

    def retry(self, key: Item) -> float:
        """Queue a name after a wait that doubles with each failure in a row; return the wait in seconds."""
        with self._changed:
            self._failures[key] = self._failures.get(key, 0) + 1
            wait_s = self._again.wait_s(self._failures[key])
        self.add_after(key, wait_s)
        return wait_s

    def failures(self, key: Item) -> int:
        """Return the number of consecutive failures of a name."""
        with self._changed:
            return self._failures.get(key, 0)

    def forget(self, key: Item) -> None:
        """Reset the failures of a name whose work succeeded."""
        with self._changed:
            self._failures.pop(key, None)

    def get(self, deadline_s: float) -> Item | None:
        """Return a name, or None after `deadline_s` or if closed; the caller must then call `done`."""
        with self._changed:
            ends = self._clock() + deadline_s
            while not self._closed:
                now = self._clock()
                self._promote(now)
                if self._ready:
                    return self._take(now)
                if now >= ends:
                    return None
                self._changed.wait(min([ends, *(due for due, _, _ in self._later[:1])]) - now)
            return None

    def done(self, key: Item) -> None:
        """End a worker's work on a name; if the name was added during the work, queue it again."""
        with self._changed:
            self._working.discard(key)
            if key in self._since:
                self._line_up(key)
                self._changed.notify_all()

    def close(self) -> None:
        """Close the queue; waiting workers return at once."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def _add(self, key: Item, now: float) -> None:
        if key in self._since:
            return
        self._since[key] = now
        if key not in self._working:
            self._line_up(key)

    def _line_up(self, key: Item) -> None:
        self._ready.setdefault(self._lane(key), deque()).append(key)

    def _take(self, now: float) -> Item:
        lane = next(iter(self._ready))
        line = self._ready.pop(lane)
        key = line.popleft()
        if line:
            self._ready[lane] = line  # the lane is now behind all other lanes
        self._waited(now - self._since.pop(key))
        self._working.add(key)
        return key

    def _promote(self, now: float) -> None:
        while self._later and self._later[0][0] <= now:
            due, _, key = heapq.heappop(self._later)
            if self._due.get(key) == due:  # otherwise `add_after` has meanwhile set an earlier time
                del self._due[key]
                self._add(key, due)
