"""What the wall clock of a run was spent on.

A ledger with one entry a cause. Every second since it was opened belongs to exactly one of them, so
that they add up to the wall clock. Only the thread that opened it spends: what others do meanwhile,
such as mending one simulator of several, costs the run nothing that it waits for.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

from palaestra_sim.protocol.status import Cause
from palaestra_trainer.waits import waited_s

TRAINING = (Cause.STEPPING, Cause.TRANSPORT, Cause.LEARNING)


class Goodput:
    """The ledger of one attempt, which begins with starting.

    A vector step is spent on transport; of that, what the thread waited for simulators is stepping.

    Args:
        clock: tells seconds, from any origin.
        waited: tells the seconds that the calling thread has waited for simulators, from any origin.
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
        """What time is spent on now."""
        return self._cause

    @contextmanager
    def spending(self, cause: Cause) -> Iterator[None]:
        """Spend the time inside on `cause`, but for what an inner one takes; other threads spend nothing."""
        if threading.get_ident() != self._owner:
            yield
            return
        before = self._turn_to(cause)
        try:
            yield
        finally:
            self._turn_to(before)

    def in_vain(self) -> None:
        """What the step under way waited, it waited for a broken simulator."""
        self._in_vain |= threading.get_ident() == self._owner

    def seconds(self) -> dict[str, float]:
        """Return the seconds spent on each cause so far; may be called from any thread.

        They add up to the wall clock, without a step that is under way: how it is to be shared out is
        known at its end only, and no cause may ever shrink.
        """
        with self._lock:
            seconds = dict(self._seconds)
            if self._cause is not Cause.TRANSPORT:
                seconds[self._cause] += self._clock() - self._since
        return {cause.value: spent for cause, spent in seconds.items()}

    def _turn_to(self, cause: Cause) -> Cause:
        """Book the time since the last turn; return the cause it was spent on."""
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
    """Return which part of the wall clock trained, 0 to 1; None before any time was spent."""
    total = sum(seconds.values())
    return sum(seconds.get(cause, 0.0) for cause in TRAINING) / total if total > 0 else None
