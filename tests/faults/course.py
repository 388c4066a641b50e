"""Count the requests between operator and API server, and decide which request gets the fault."""

import threading
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

from tests.faults.plans import Fault, Kind
from tests.faults.requests import ANSWER, CHANGE, LEASE, WATCH, Asked

QUIET_KINDS = frozenset({LEASE, WATCH, ANSWER})  # an idle operator sends only these


@dataclass(frozen=True, slots=True, kw_only=True)
class Passed:
    """A request that was counted, and its time in seconds of the monotonic clock."""

    asked: Asked
    at: float


class Course:
    """Counts requests and decides which of them gets the fault; safe to use from several threads.

    Attributes:
        met: the request that got the fault, or "" before that.
    """

    def __init__(self, fault: Fault | None, clock: Callable[[], float] = time.monotonic) -> None:
        self.met = ""
        self._fault = fault
        self._clock = clock
        self._lock = threading.Lock()
        self._counts: Counter[str] = Counter()
        self._passed: list[Passed] = []
        self._away_until = 0.0

    @property
    def counts(self) -> Counter[str]:
        """The number of requests of each kind."""
        with self._lock:
            return Counter(self._counts)

    @property
    def away(self) -> bool:
        """Whether the proxy refuses all requests now."""
        return self._clock() < self._away_until

    def leave(self, seconds: float) -> None:
        """Refuse all requests for `seconds`."""
        self._away_until = self._clock() + seconds

    def request(self, asked: Asked) -> Fault | None:
        """Count a request, and return the fault that it gets, or None."""
        with self._lock:
            self._passed.append(Passed(asked=asked, at=self._clock()))
            return self._count(asked.kind, asked.words)

    def change(self, watched: Asked) -> Fault | None:
        """Count an event of a watch, and return the fault that it gets, or None."""
        with self._lock:
            return self._count(CHANGE, watched.words)

    def quiet_s(self) -> float:
        """Return the seconds since the last request other than a watch or a Lease request."""
        with self._lock:
            last = max((each.at for each in self._passed if each.asked.kind not in QUIET_KINDS), default=0.0)
        return self._clock() - last

    def last(self, count: int) -> list[str]:
        """Return the last `count` requests as text, without watches and Lease requests."""
        with self._lock:
            return [each.asked.words for each in self._passed if each.asked.kind not in QUIET_KINDS][-count:]

    def _count(self, kind: str, words: str) -> Fault | None:
        self._counts[kind] += 1
        fault = self._fault
        if fault is None or (fault.request, fault.number) != (kind, self._counts[kind]):
            return None
        self.met = words
        if fault.kind == Kind.AWAY:
            self.leave(fault.seconds)
        return fault
