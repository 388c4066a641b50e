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


def next_of(moments: Iterable[datetime | None], now: datetime) -> float | None:
    """Return the seconds to the first moment after `now`; None where there is none."""
    ahead = [(at - now).total_seconds() for at in moments if at is not None and at > now]
    return min(ahead, default=None)
