"""Count what passes between operator and API server, and say when the fault is due."""

import threading
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

from tests.faults.plans import Fault, Kind
from tests.faults.requests import ANSWER, CHANGE, LEASE, WATCH, Asked

QUIET_KINDS = frozenset({LEASE, WATCH, ANSWER})  # an operator at rest asks for these, and for nothing else


@dataclass(frozen=True, slots=True, kw_only=True)
class Passed:
    """A request that came by: what it was about, and when, in seconds of the monotonic clock."""

    asked: Asked
    at: float


class Course:
    """Counts requests and says which of them is disturbed; safe to use from several threads.

    Attributes:
        met: the request that the fault came at; "" until then.
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
        """How many requests of each kind came by."""
        with self._lock:
            return Counter(self._counts)

    @property
    def away(self) -> bool:
        """Whether nobody is served now."""
        return self._clock() < self._away_until

    def leave(self, seconds: float) -> None:
        """Serve nobody from now on for so long."""
        self._away_until = self._clock() + seconds

    def request(self, asked: Asked) -> Fault | None:
        """Count a request; return the fault that it meets."""
        with self._lock:
            self._passed.append(Passed(asked=asked, at=self._clock()))
            return self._count(asked.kind, asked.words)

    def change(self, watched: Asked) -> Fault | None:
        """Count an event of a watch; return the fault that it meets."""
        with self._lock:
            return self._count(CHANGE, watched.words)

    def quiet_s(self) -> float:
        """Return the seconds since anything but a watch or the Lease was asked for."""
        with self._lock:
            last = max((each.at for each in self._passed if each.asked.kind not in QUIET_KINDS), default=0.0)
        return self._clock() - last

    def last(self, count: int) -> list[str]:
        """Return the last requests but watches and the Lease, for people."""
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
