"""Divide the wall-clock time of a run among causes.

Every second since the start is counted under exactly one cause, so the causes add up to the wall-clock time.
Only the thread that created the ledger counts time. The work of other threads is not counted, because it does
not delay the run. An example is the restart of one of several simulators.
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
    """The ledger of one attempt, which begins with the cause `starting`.

    In a vector step, the time that the thread waits for simulators counts as stepping, and the rest counts as
    transport.

    Args:
        clock: a function that returns seconds from any starting point.
        waited: a function that returns the seconds that the calling thread has waited for simulators, from
            any starting point.
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
        """The cause under which time is currently counted."""
        return self._cause

    @contextmanager
    def spending(self, cause: Cause) -> Iterator[None]:
        """Count the time in the context under `cause`, except in inner contexts and in other threads."""
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
        """Return the seconds under each cause so far; any thread may call this method.

        The seconds add up to the wall-clock time without the current step. A step can be divided among the
        causes only at its end, and the seconds of a cause must never decrease.
        """
        with self._lock:
            seconds = dict(self._seconds)
            if self._cause is not Cause.TRANSPORT:
                seconds[self._cause] += self._clock() - self._since
        return {cause.value: spent for cause, spent in seconds.items()}

    def _turn_to(self, cause: Cause) -> Cause:
        """Count the time since the last call, switch to `cause`, and return the previous cause."""
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
    """Return the share of the time that was spent on training, 0 to 1; None before any time was counted."""
    total = sum(seconds.values())
    return sum(seconds.get(cause, 0.0) for cause in TRAINING) / total if total > 0 else None
