"""Moments and the seconds between them. A status has whole seconds, so decisions do too."""

from collections.abc import Iterable
from datetime import UTC, datetime, timedelta


def whole(at: datetime) -> datetime:
    """Return a time with a time zone in UTC and whole seconds, as a status holds it."""
    return at.astimezone(UTC).replace(microsecond=0)


def after(at: datetime, seconds: float) -> datetime:
    """Return the moment `seconds` after `at`."""
    return at + timedelta(seconds=seconds)


def seconds_between(before: datetime, later: datetime) -> int:
    """Return the whole seconds from one moment to a later one, 0 where it is not later."""
    return max(int((later - before).total_seconds()), 0)


def seconds_to(at: datetime | None, now: datetime) -> float | None:
    """Return the seconds from `now` to `at`; None where there is no such moment."""
    return None if at is None else (at - now).total_seconds()


def first_of(waits_s: Iterable[float | None]) -> float | None:
    """Return the seconds until the first of some waits is over; None: none goes on."""
    return min((waits_ for waits_ in waits_s if waits_ is not None and waits_ > 0), default=None)
