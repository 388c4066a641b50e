"""The clocks of one reconcile, and the record of the previous reconcile in this process.

The wall clock of a node may be minutes off, and an administrator may set the clock of the operator's node. So
a wait is measured on this process's monotonic clock, from the reconcile that first found the wait. After a
restart or with a new leader, every wait begins again, so a wait can become longer, but not shorter. The wall
clock gives the times in a status. Only the time to live is measured on the wall clock, from a time that the
operator wrote. A status has times in whole seconds, so decisions use whole seconds too.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta

from palaestra.decide.explanation import Explanation

WaitKey = tuple[int | str, ...]  # the number of the replica, then the items of `Wait.key`


@dataclass(frozen=True, slots=True, kw_only=True)
class Wait:
    """A wait with a deadline.

    Attributes:
        key: identifies the wait within a replica; a wait with another key begins again.
        seconds: the deadline, in seconds from the beginning of the wait.
        begun_s: the time on the monotonic clock at which the wait began; None: the time of the first
            reconcile that found the wait.
    """

    key: tuple[str, ...]
    seconds: float
    begun_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class WaitingReason:
    """A cause that delays a replica's first step.

    Attributes:
        explanation: the reason and its message.
        gone_s: the time on the monotonic clock of the first reconcile that no longer found the cause; None:
            the cause still exists.
    """

    explanation: Explanation
    gone_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ReconcileRecord:
    """The data that one reconcile passes to the next reconcile of the same process; a restart loses it.

    Attributes:
        waits: the time on the monotonic clock at which each open wait was first found.
        troubles: waiting reason of each replica that waits for its first step.
        active_s: seconds for which this process knows that the job was active.
        active_at_s: the time on the monotonic clock up to which `active_s` is counted; None: the job is not
            active.
    """

    waits: Mapping[WaitKey, float] = field(default_factory=dict)
    troubles: Mapping[int, WaitingReason] = field(default_factory=dict)
    active_s: float = 0.0
    active_at_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Times:
    """The clocks at one reconcile.

    Attributes:
        now: the wall clock, with a time zone.
        clock_s: the monotonic clock of this process.
        record: the record of the previous reconcile.
    """

    now: datetime
    clock_s: float
    record: ReconcileRecord = field(default_factory=ReconcileRecord)

    def since_s(self, replica: int, wait: Wait) -> float:
        """Return the start time of a replica's wait, on the monotonic clock."""
        begun_s = self.clock_s if wait.begun_s is None else min(wait.begun_s, self.clock_s)
        return self.record.waits.get((replica, *wait.key), begun_s)

    def active_s(self, written_s: int) -> float:
        """Return the seconds for which the job was active; `written_s` is the value in its status."""
        record = self.record
        elapsed_s = 0.0 if record.active_at_s is None else self.clock_s - record.active_at_s
        return max(float(written_s), record.active_s + elapsed_s)


def whole(at: datetime) -> datetime:
    """Return a time in UTC and whole seconds, as in a status; `at` has a time zone."""
    return at.astimezone(UTC).replace(microsecond=0)


def after(at: datetime, seconds: float) -> datetime:
    """Return the moment `seconds` after `at`."""
    return at + timedelta(seconds=seconds)


def seconds_between(before: datetime, later: datetime) -> int:
    """Return the whole seconds from `before` to `later`; 0 if `later` is not later."""
    return max(int((later - before).total_seconds()), 0)


def seconds_to(at: datetime | None, now: datetime) -> float | None:
    """Return the seconds from `now` to `at`; None if `at` is None."""
    return None if at is None else (at - now).total_seconds()


def first_of(waits_s: Iterable[float | None]) -> float | None:
    """Return the seconds until the first open wait ends; None if no wait is open."""
    return min((waits_ for waits_ in waits_s if waits_ is not None and waits_ > 0), default=None)
