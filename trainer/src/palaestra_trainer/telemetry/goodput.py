"""Account for the wall clock of a run, by cause.

Every second since the start is booked on exactly one cause, so the causes add up to the wall clock. Only the
thread that created the ledger books time. Work of other threads, such as the repair of one of several
simulators, does not delay the run, so it is not booked.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

from palaestra_protocol.pod.status import Cause
from palaestra_trainer.waiting.wait_time import waited_s

TRAINING = (Cause.STEPPING, Cause.TRANSPORT, Cause.LEARNING)


class GoodputLedger:
    """The ledger of one attempt; it begins with the cause `starting`.

    A vector step is booked on transport, except the time that the thread waited for simulators, which is
    booked on stepping.

    Args:
        clock: returns seconds, from any origin.
        waited: returns the seconds that the calling thread has waited for simulators, from any origin.
    """

    def __init__(
        self, clock: Callable[[], float] = time.perf_counter, waited: Callable[[], float] = waited_s
    ) -> None:
        self._clock = clock
        self._waited = waited
        self._lock = threading.Lock()
        self._owner = threading.get_ident()
        self._seconds = dict.fromkeys(Cause, 0.0)
        self._cause = Cause.STARTING
        self._since, self._waited_before = clock(), waited()
        self._in_vain = False

    @property
    def cause(self) -> Cause:
        """The cause that time is booked on now."""
        return self._cause

    @contextmanager
    def spending(self, cause: Cause) -> Iterator[None]:
        """Book the time inside on `cause`, except that of inner contexts; no effect in other threads."""
        if threading.get_ident() != self._owner:
            yield
            return
        before = self._turn_to(cause)
        try:
            yield
        finally:
            self._turn_to(before)

    def in_vain(self) -> None:
        """Count this step's wait as recovering, not as stepping."""
        self._in_vain |= threading.get_ident() == self._owner

    def seconds(self) -> dict[str, float]:
        """Return the seconds booked on each cause so far; may be called from any thread.

        They add up to the wall clock without the current step. How to divide that step among the causes is
        known only at its end, and no cause may ever decrease.
        """
        with self._lock:
            seconds = dict(self._seconds)
            if self._cause is not Cause.TRANSPORT:
                seconds[self._cause] += self._clock() - self._since
        return {cause.value: spent for cause, spent in seconds.items()}

    def _turn_to(self, cause: Cause) -> Cause:
        """Book the time since the last call and switch to `cause`; return the previous cause."""
        with self._lock:
            before, now, waited = self._cause, self._clock(), self._waited()
            spent = now - self._since
            if before is Cause.TRANSPORT:
                answered = min(waited - self._waited_before, spent)
                self._seconds[Cause.RECOVERING if self._in_vain else Cause.STEPPING] += answered
                spent -= answered
            self._seconds[before] += spent
            self._cause, self._since, self._waited_before = cause, now, waited
            self._in_vain = False
            return before


def trained_share(seconds: Mapping[str, float]) -> float | None:
    """Return the share of the wall clock that trained, 0 to 1; None before any time was booked."""
    total = sum(seconds.values())
    return sum(seconds.get(cause, 0.0) for cause in TRAINING) / total if total > 0 else None
