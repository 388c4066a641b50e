"""The write of a status: its data, its time, and its size limit.

A status with a new state or a first value is written at once; progress is written every 30 seconds. Kueue's
message contains the missing amounts of resources. These amounts count as progress, because other jobs change
them often.

etcd refuses an object of more than 1.5 MiB, and the operator would retry the write forever. Each field of a
status has its own limit. But the status of a hundred replicas with 32 simulators each exceeds 1.5 MiB, and
the spec needs space too. So the least important details are removed until the object fits. These details are
only for people. Decisions and events must not depend on removed details, because each reconcile would then
emit the same event again.
"""

import json
import re
from collections.abc import Callable, Mapping
from typing import Any

from palaestra.api.reasons import Reason
from palaestra.api.status import Phase, Status
from palaestra.observe.cache_trim import SIZE, SMALL
from palaestra.observe.json_access import part, text

PROGRESS_EVERY_S = 30
_WITH_OTHERS = frozenset({"activeSeconds", "activeSince"})  # written together with other changes, never alone
_OF_JOB = frozenset({"lastCheckpointTime", "leftOut", "nodes", "step", "successRate"})
_FIRST = frozenset(  # a first value of these fields is written at once; later values count as progress
    {"step", "target", "successRate", "successInterval", "lastEvaluation", "lastCheckpoint"}
)
_OF_REPLICA = frozenset(
    {"step", "target", "successRate", "successInterval", "meanReturn", "stepsPerSecond", "simulators",
     "lastEvaluation", "lastCheckpoint", "node",
     "furthestStep", "simulatorRestarts", "lastProgress", "faults", "goodput", "stepsLost"}
)  # fmt: skip
_AMOUNT = re.compile(r"\d[\w.]*")  # an amount, such as 425m or 1.5Gi

# Limit of the whole object in a request; etcd accepts 1,572,864 bytes, including managedFields.
MOST_BYTES = 1_400_000
SHORT = 100  # bytes of a shortened message in a request

Data = dict[str, Any]
Cut = Callable[[Data], Data]

_HEALTHY = frozenset({Phase.RUNNING.value, Phase.SUCCEEDED.value})
_OF_KILL = ("container", "times", "last")


def as_data(status: Status) -> dict[str, Any]:
    """Return the status in the form that the API server stores: camelCase, no absent fields, no empty lists.

    `kubectl describe` would print a heading for each empty list. Programs that read a status treat an absent
    list as empty.
    """
    data: dict[str, Any] = _without_empty(status.model_dump(mode="json", by_alias=True, exclude_none=True))
    return data


def _without_empty(data: Any) -> Any:
    if isinstance(data, Mapping):
        kept = {name: _without_empty(value) for name, value in data.items()}
        return {name: value for name, value in kept.items() if value != []}
    return [_without_empty(item) for item in data] if isinstance(data, list) else data


def write_in_s(old: Mapping[str, Any] | None, new: Mapping[str, Any], since_s: float | None) -> float | None:
    """Return the seconds until the status must be written; 0: now; None: no write is needed.

    Args:
        old: the status from the API server.
        new: the status from `as_data`.
        since_s: seconds since this process last wrote the job's status, on a monotonic clock; None: this
            process has not written the status.
    """
    # An older CRD has defaults for lists, so the API server adds the empty lists again.
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
    """Return a condition or replica; if its reason is `Queued`, remove the amounts from its message."""
    if not isinstance(reported, Mapping) or reported.get("reason") != Reason.QUEUED:
        return reported
    return {**reported, "message": _AMOUNT.sub("", str(reported.get("message")))}


def _rest(replica: Any) -> Any:
    if not isinstance(replica, Mapping):
        return replica
    kept = {name: value for name, value in _without_amounts(replica).items() if name not in _OF_REPLICA}
    kept |= dict.fromkeys(_FIRST & replica.keys())  # a first value is written at once, a changed value later
    restarts = kept.get("restarts")
    # Simulators may restart often, so this count is written only together with the progress.
    if isinstance(restarts, Mapping):
        kept["restarts"] = {name: value for name, value in restarts.items() if name != "simulator"}
    return kept


def fitted(job: Mapping[str, Any], status: Data) -> Data:
    """Return a status from `as_data` without the details that do not fit into the TrainingJob.

    The function is deterministic, and a second call on the result returns it unchanged. If the spec leaves
    less than 450,000 bytes for the status, the result may still be too large.
    """
    room = MOST_BYTES - _taken(job)
    for cut in CUTS:
        if _size(status) <= room:
            break
        status = cut(status)
    return status


def _size(data: Any) -> int:
    return len(json.dumps(data))  # JSON in ASCII, as in requests


def _taken(job: Mapping[str, Any]) -> int:
    """Return the bytes of a job without its status; a job without a noted size counts as `SMALL` bytes."""
    noted = text(part(job, "metadata", "annotations"), SIZE)
    return int(noted) if noted.isdecimal() else SMALL


def _of_replicas(cut: Cut, *, healthy: bool | None = None) -> Cut:
    """Return a cut that applies `cut` to all replicas, or only to the healthy or to the unhealthy ones."""

    def cuts(replica: Data) -> bool:
        return healthy is None or (replica.get("phase") in _HEALTHY) is healthy

    def all_of(status: Data) -> Data:
        return {
            **status,
            "replicas": [
                cut(replica) if cuts(replica) else replica for replica in status.get("replicas", ())
            ],
        }

    return all_of


def _simulators(replica: Data) -> Data:
    return _without(replica, frozenset({"simulators"}))


def _faults(replica: Data) -> Data:
    return _in_attempt(replica, lambda attempt: _without(attempt, frozenset({"faults"})))


def _log(replica: Data) -> Data:
    return _in_attempt(replica, lambda attempt: _without(attempt, frozenset({"log"})))


def _messages(replica: Data) -> Data:
    return _in_attempt(_shortened(replica), _shortened)


def _memory_kills(replica: Data) -> Data:
    """Return a replica with only container, count and time of each kill; these three identify the kill."""
    kills = [{name: kill[name] for name in _OF_KILL} for kill in replica.get("memoryKills", ())]
    return {**replica, "memoryKills": kills}


def _left_out(status: Data) -> Data:
    return _without(status, frozenset({"leftOut"}))


def _conditions(status: Data) -> Data:
    return {**status, "conditions": [_shortened(condition) for condition in status.get("conditions", ())]}


# The cuts are applied in this order until the status fits.
CUTS: tuple[Cut, ...] = (
    _of_replicas(_simulators, healthy=True),
    _of_replicas(_faults, healthy=True),
    _of_replicas(_log, healthy=True),
    _of_replicas(_simulators, healthy=False),
    _of_replicas(_faults, healthy=False),
    _of_replicas(_log, healthy=False),
    _left_out,
    _of_replicas(_messages),
    _conditions,
    _of_replicas(_memory_kills),
)


def _in_attempt(replica: Data, cut: Cut) -> Data:
    attempt = replica.get("lastAttempt")
    return replica if attempt is None else {**replica, "lastAttempt": cut(attempt)}


def _shortened(data: Data) -> Data:
    message = data.get("message")
    if message is None or _size(message) <= SHORT:
        return data
    most = next(n for n in range(SHORT, -1, -1) if _size(message[:n]) <= SHORT - len("..."))
    return {**data, "message": f"{message[:most]}..."}
