"""The time of the next status write: at once for new states and first values, else every 30 seconds.

The amounts in Kueue's message, which the job lacks, count as progress: other jobs change them often.
"""

import re
from collections.abc import Mapping
from typing import Any

from palaestra.api.reasons import Reason
from palaestra.api.status import Status

PROGRESS_EVERY_S = 30
_WITH_OTHERS = frozenset({"activeSeconds", "activeSince"})  # written with other changes, never alone
_OF_JOB = frozenset({"lastCheckpointTime", "leftOut", "nodes", "step", "successRate"})
_FIRST = frozenset(  # once present, always present
    {"step", "target", "successRate", "successInterval", "lastCheckpoint"}
)
_OF_REPLICA = frozenset(
    {"step", "target", "successRate", "successInterval", "meanReturn", "stepsPerSecond", "simulators",
     "lastCheckpoint", "node",
     "furthestStep", "simulatorRestarts", "lastProgress", "faults", "goodput", "stepsLost"}
)  # fmt: skip


_AMOUNT = re.compile(r"\d[\w.]*")  # such as 425m or 1.5Gi


def as_data(status: Status) -> dict[str, Any]:
    """Return the status as the API server stores it: camelCase, without absent fields and empty lists.

    `kubectl describe` prints a heading for each empty list, and readers treat an absent list as empty.
    """
    data: dict[str, Any] = _without_empty(status.model_dump(mode="json", by_alias=True, exclude_none=True))
    return data


def _without_empty(data: Any) -> Any:
    if isinstance(data, Mapping):
        kept = {name: _without_empty(value) for name, value in data.items()}
        return {name: value for name, value in kept.items() if value != []}
    return [_without_empty(item) for item in data] if isinstance(data, list) else data


def write_in_s(old: Mapping[str, Any] | None, new: Mapping[str, Any], since_s: float | None) -> float | None:
    """Return the seconds after which to write a status; 0: now; None: never.

    Args:
        old: from the API server.
        new: from `as_data`.
        since_s: seconds since this job's status was last written, on a monotonic clock; None: this process
            has not written it.
    """
    # An API server with an older CRD adds the empty lists again.
    before = _without_empty(_without(old if isinstance(old, Mapping) else {}, _WITH_OTHERS))
    after = _without(new, _WITH_OTHERS)
    if before == after:
        return None
    if since_s is None or _without_progress(before) != _without_progress(after):
        return 0.0
    return max(PROGRESS_EVERY_S - since_s, 0.0)


def _without(status: Mapping[str, Any], names: frozenset[str]) -> dict[str, Any]:
    return {name: value for name, value in status.items() if name not in names}


def _without_progress(status: Mapping[str, Any]) -> dict[str, Any]:
    rest = _without(status, _OF_JOB)
    for name, kept in (("replicas", _rest), ("conditions", _without_amounts)):
        if isinstance(items := rest.get(name), list):
            rest[name] = [kept(item) for item in items]
    return rest


def _without_amounts(reported: Any) -> Any:
    """Return a condition or replica; if it waits in a queue, the amounts in its message are removed."""
    if not isinstance(reported, Mapping) or reported.get("reason") != Reason.QUEUED:
        return reported
    return {**reported, "message": _AMOUNT.sub("", str(reported.get("message")))}


def _rest(replica: Any) -> Any:
    if not isinstance(replica, Mapping):
        return replica
    kept = {name: value for name, value in _without_amounts(replica).items() if name not in _OF_REPLICA}
    kept |= dict.fromkeys(_FIRST & replica.keys())  # only the first value is urgent
    restarts = kept.get("restarts")
    if isinstance(restarts, Mapping):  # restarts of simulators are as frequent as faults
        kept["restarts"] = {name: value for name, value in restarts.items() if name != "simulator"}
    return kept
