"""The deletion of a TrainingJob when its time to live after the end has passed."""

from datetime import datetime

from palaestra.api.status import TERMINAL, Status
from palaestra.decide.clocks import after, seconds_between
from palaestra.decide.decision import Delete


def expires(status: Status, ttl_s: int | None) -> datetime | None:
    """Return the time at which to delete an ended job; None: never, or it has not ended."""
    if ttl_s is None or status.phase not in TERMINAL or status.completion_time is None:
        return None
    return after(status.completion_time, ttl_s)


def expired(
    name: str, uid: str | None, at: datetime | None, status: Status, now: datetime
) -> tuple[Delete, ...]:
    """Return the deletion of the TrainingJob, if its time `at` has come."""
    if at is None or at > now or uid is None:
        return ()
    return (Delete(name=name, uid=uid, after_s=seconds_between(status.completion_time or now, now)),)
