"""When a status is worth a write: what people wait for at once, progress every half minute but its first."""

from collections.abc import Mapping
from datetime import datetime
from typing import Any

from palaestra.api.status import Status

PROGRESS_EVERY_S = 30
_OF_JOB = frozenset({"step", "successRate"})
_FIRST = frozenset({"step", "target", "successRate", "lastCheckpoint"})  # never absent once they were there
_OF_REPLICA = frozenset(
    {"step", "target", "successRate", "meanReturn", "stepsPerSecond", "simulators", "lastCheckpoint",
     "furthestStep", "simulatorRestarts", "lastProgress", "faults", "goodput", "stepsLost"}
)  # fmt: skip


def as_data(status: Status) -> dict[str, Any]:
    """Return the status as the API server holds it: camelCase, nothing that is absent."""
    return status.model_dump(mode="json", by_alias=True, exclude_none=True)


def worth_writing(
    old: Mapping[str, Any] | None,
    new: Mapping[str, Any],
    last_written: datetime | None,
    now: datetime,
) -> bool:
    """Return whether to write a status now.

    Args:
        old: as the API server holds it.
        new: as `as_data` gives it.
        last_written: when this job's status was last written; None: not by this process.
        now: with a time zone, as `last_written`.
    """
    before = old if isinstance(old, Mapping) else {}
    if before == new:
        return False
    if _without_progress(before) != _without_progress(new) or last_written is None:
        return True
    return (now - last_written).total_seconds() >= PROGRESS_EVERY_S


def _without_progress(status: Mapping[str, Any]) -> dict[str, Any]:
    rest = {name: value for name, value in status.items() if name not in _OF_JOB}
    replicas = rest.get("replicas")
    if isinstance(replicas, list):
        rest["replicas"] = [_rest(each) for each in replicas]
    return rest


def _rest(replica: Any) -> Any:
    if not isinstance(replica, Mapping):
        return replica
    kept = {name: value for name, value in replica.items() if name not in _OF_REPLICA}
    kept |= dict.fromkeys(_FIRST & replica.keys())  # that there is one is news; how large it is, is not
    restarts = kept.get("restarts")
    if isinstance(restarts, Mapping):  # those of simulators are as frequent as faults are
        kept["restarts"] = {name: value for name, value in restarts.items() if name != "simulator"}
    return kept
