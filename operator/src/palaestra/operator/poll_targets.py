"""The trainers to poll; each watch event updates them, so callers need not read all pods.

Labels alone do not make a pod a trainer. A known Job must own the pod, and the TrainingJob in the label must
own this Job. Of a pod, only its address and its owners are stored.
"""

import ipaddress
from dataclasses import dataclass

from palaestra.objects import Key, Object
from palaestra.observe.json_access import owners, part, parts, text
from palaestra.operator.poll_schedule import PollTarget
from palaestra.plan.layout import STATUS_PORT
from palaestra.plan.replica import JOB_LABEL, TRAINER


@dataclass(frozen=True, slots=True, kw_only=True)
class _Job:
    key: Key
    uid: str
    owners: frozenset[str]


class PollTargets:
    """The running trainers, updated by the caches; any thread may read them."""

    def __init__(self) -> None:
        self._training_jobs: dict[Key, str] = {}
        self._jobs: dict[Key, _Job] = {}
        self._pods: dict[Key, tuple[PollTarget, frozenset[str]]] = {}

    def training_job(self, obj: Object, *, exists: bool) -> None:
        """Record the newest state of a TrainingJob; if it was deleted (`exists` is False), remove it."""
        name = _name(obj)
        if exists:
            self._training_jobs[name] = text(part(obj, "metadata"), "uid")
        else:
            self._training_jobs.pop(name, None)

    def job(self, obj: Object, *, exists: bool) -> None:
        """Record the newest state of a batch/v1 Job; if it was deleted (`exists` is False), remove it."""
        name, uid = _name(obj), text(part(obj, "metadata"), "uid")
        if exists:
            self._jobs[name] = _Job(key=_key(obj), uid=uid, owners=owners(obj))
        else:
            self._jobs.pop(name, None)

    def pod(self, obj: Object, *, exists: bool) -> None:
        """Record the newest state of a pod; if it was deleted (`exists` is False), remove it."""
        name, host = _name(obj), _address(obj)
        if exists and host is not None and _trains(obj):
            uid = text(part(obj, "metadata"), "uid")
            self._pods[name] = PollTarget(key=_key(obj), uid=uid, host=host, port=STATUS_PORT), owners(obj)
        else:
            self._pods.pop(name, None)

    def targets(self) -> list[PollTarget]:
        """Return the trainers to poll."""
        keys = {
            job.uid: job.key
            for job in tuple(self._jobs.values())
            if self._training_jobs.get(job.key) in job.owners
        }
        pods = tuple(self._pods.values())
        return [target for target, uids in pods if any(keys.get(uid) == target.key for uid in uids)]


def _name(obj: Object) -> Key:
    return obj["metadata"]["namespace"], obj["metadata"]["name"]


def _key(obj: Object) -> Key:
    """Return the key of the TrainingJob in a child's label."""
    return obj["metadata"]["namespace"], obj["metadata"]["labels"][JOB_LABEL]


def _trains(pod: Object) -> bool:
    """Return whether the trainer's container runs."""
    states = {
        text(container, "name"): part(container, "state")
        for container in parts(pod, "status", "containerStatuses")
    }
    return "running" in states.get(TRAINER, {}) and "deletionTimestamp" not in pod["metadata"]


def _address(pod: Object) -> str | None:
    """Return a pod's IP address, or None. A host name is not resolved."""
    try:
        return str(ipaddress.ip_address(text(part(pod, "status"), "podIP")))
    except ValueError:
        return None
