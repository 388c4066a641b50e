"""Cut a status to the size that its object may have; the least important details go first.

etcd refuses an object of more than 1.5 MiB, and the operator would retry the write forever. Each field of a
status has its own limit, but the status of a hundred replicas with 32 simulators each exceeds that size, and
the author's spec adds to it. The removed details are only for people. No decision and no event depends on
them; otherwise each reconcile would emit the event again.
"""

import json
from collections.abc import Callable, Mapping
from typing import Any

from palaestra.api.status import Phase
from palaestra.observe.cache_trim import SIZE, SMALL
from palaestra.observe.json_access import part, text

MOST_BYTES = 1_400_000  # of the whole object as sent; etcd accepts 1,572,864, including managedFields
SHORT = 100  # bytes of a shortened message as sent

Data = dict[str, Any]
Cut = Callable[[Data], Data]

_HEALTHY = frozenset({Phase.RUNNING.value, Phase.SUCCEEDED.value})
_OF_KILL = ("container", "times", "last")


def fitted(job: Mapping[str, Any], status: Data) -> Data:
    """Return a status from `as_data` without the details that do not fit into its object.

    The same status gives the same result, and a second call changes nothing. If the spec leaves less than
    450,000 bytes for the status, the result may still be too large.
    """
    room = MOST_BYTES - _taken(job)
    for cut in CUTS:
        if _size(status) <= room:
            break
        status = cut(status)
    return status


def _size(data: Any) -> int:
    return len(json.dumps(data))  # in ASCII, like requests


def _taken(job: Mapping[str, Any]) -> int:
    """Return the bytes of a job without its status; for a small job, the upper limit of small jobs."""
    noted = text(part(job, "metadata", "annotations"), SIZE)
    return int(noted) if noted.isdecimal() else SMALL


def _of_replicas(cut: Cut, *, healthy: bool | None = None) -> Cut:
    """Return a cut of all replicas, or only of the healthy or the unhealthy ones."""

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
    return _without(replica, "simulators")


def _faults(replica: Data) -> Data:
    return _in_attempt(replica, lambda attempt: _without(attempt, "faults"))


def _log(replica: Data) -> Data:
    return _in_attempt(replica, lambda attempt: _without(attempt, "log"))


def _messages(replica: Data) -> Data:
    return _in_attempt(_shortened(replica), _shortened)


def _memory_kills(replica: Data) -> Data:
    """Return a replica with only the count and the time of each kill, which identify a kill."""
    kills = [{name: kill[name] for name in _OF_KILL} for kill in replica.get("memoryKills", ())]
    return {**replica, "memoryKills": kills}


def _left_out(status: Data) -> Data:
    return _without(status, "leftOut")


def _conditions(status: Data) -> Data:
    return {**status, "conditions": [_shortened(condition) for condition in status.get("conditions", ())]}


# Applied in this order until the status fits.
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


def _without(data: Data, name: str) -> Data:
    return {key: value for key, value in data.items() if key != name}
