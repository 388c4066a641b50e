"""A status within the bytes that its object may have: what people miss least goes first.

etcd refuses an object of more than 1.5 MiB, and the operator would send it again for ever. Each field of a
status has a bound of its own, but a hundred replicas of 32 simulators are larger together, and the author's
spec comes on top. What is left out here is only shown to people: no decision depends on it, and no event, or
each look would emit it again.
"""

import json
from collections.abc import Callable, Mapping
from typing import Any

from palaestra.api.status import Phase
from palaestra.observe.reading import part, text
from palaestra.observe.trim import SIZE, SMALL

MOST_BYTES = 1_400_000  # of the whole object, as it is sent; etcd takes 1,572,864, with who wrote which field
SHORT = 100  # bytes of a message as it is sent, where little else helps

Data = dict[str, Any]
Cut = Callable[[Data], Data]

_HEALTHY = frozenset({Phase.RUNNING.value, Phase.SUCCEEDED.value})
_OF_KILL = ("container", "times", "last")


def fitted(job: Mapping[str, Any], status: Data) -> Data:
    """Return a status as `as_data` gives it, without the details for which its job has no room.

    The same status gives the same result, and a result is not cut again. A spec that leaves less than 450,000
    bytes may leave too little.
    """
    room = MOST_BYTES - _taken(job)
    for cut in CUTS:
        if _size(status) <= room:
            break
        status = cut(status)
    return status


def _size(data: Any) -> int:
    return len(json.dumps(data))  # in ASCII, as requests are


def _taken(job: Mapping[str, Any]) -> int:
    """Return the bytes of a job without its status, or the most that a small one may have."""
    told = text(part(job, "metadata", "annotations"), SIZE)
    return int(told) if told.isdecimal() else SMALL


def _of_replicas(cut: Cut, *, healthy: bool | None = None) -> Cut:
    """Return what cuts all replicas, or those that are healthy, or those that are not."""

    def cuts(replica: Data) -> bool:
        return healthy is None or (replica.get("phase") in _HEALTHY) is healthy

    def all_of(status: Data) -> Data:
        return {**status, "replicas": [cut(it) if cuts(it) else it for it in status.get("replicas", ())]}

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
    """Return a replica whose kills are counted, and known again by their time."""
    kills = [{name: each[name] for name in _OF_KILL} for each in replica.get("memoryKills", ())]
    return {**replica, "memoryKills": kills}


def _conditions(status: Data) -> Data:
    return {**status, "conditions": [_shortened(each) for each in status.get("conditions", ())]}


# In this order, until the rest fits.
CUTS: tuple[Cut, ...] = (
    _of_replicas(_simulators, healthy=True),
    _of_replicas(_faults, healthy=True),
    _of_replicas(_log, healthy=True),
    _of_replicas(_simulators, healthy=False),
    _of_replicas(_faults, healthy=False),
    _of_replicas(_log, healthy=False),
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
