"""The operator's caches, one for each kind of object; they store trimmed copies of the objects.

They store all TrainingJobs; of the other kinds, they store only objects with the label palaestra.dev/job. So
the operator's memory does not grow with the other workloads of the cluster.
"""

import time
from collections.abc import Callable, Collection, Iterable, Sequence
from functools import partial

from palaestra.api.reasons import WAITING
from palaestra.api.status import Phase
from palaestra.cluster import Api, Resource
from palaestra.cluster.resources import (
    CLAIMS,
    CONFIG_MAPS,
    JOBS,
    NETWORK_POLICIES,
    PODS,
    TRAINING_JOBS,
)
from palaestra.objects import Key, Object
from palaestra.observe import trimmed
from palaestra.observe.json_access import count, parts, text
from palaestra.operator.informer import Informer
from palaestra.operator.poll_schedule import PollTarget
from palaestra.operator.poll_targets import PollTargets
from palaestra.plan.replica import JOB_LABEL

Changed = Callable[[Key], None]

_WAITING = frozenset(reason.value for reason in WAITING)

CHILDREN = (JOBS, PODS, CLAIMS, CONFIG_MAPS.only_metadata(), NETWORK_POLICIES)


class Caches:
    """The objects of some or all namespaces; the caches may be slightly behind the cluster.

    Args:
        api: the cluster.
        namespaces: the namespaces to watch; empty: all namespaces.
        changed: called with the key of each TrainingJob that changed, or whose child changed.
    """

    def __init__(self, api: Api, namespaces: Sequence[str], changed: Changed) -> None:
        self._changed = changed
        self._phases: dict[Key, str] = {}
        self._waits: dict[Key, tuple[str, ...]] = {}
        self._trainers = PollTargets()
        self._jobs = Informer(
            api, TRAINING_JOBS, namespaces=namespaces, keep=trimmed, changed=self._job_changed
        )
        self._children = {
            resource.plural: Informer(
                api,
                resource,
                namespaces=namespaces,
                labels=JOB_LABEL,
                keep=trimmed,
                changed=partial(self._child_changed, resource),
            )
            for resource in CHILDREN
        }

    def start(self) -> None:
        """Start all watches."""
        for reflector in self._all():
            reflector.start()

    def stop(self, deadline_s: float) -> None:
        """Stop all watches; a watch that does not stop within `deadline_s` ends with the process."""
        for reflector in self._all():
            reflector.stop(0.0)
        self._jobs.stop(deadline_s)

    def wait_synced(self, deadline_s: float) -> bool:
        """Wait at most `deadline_s`, and return whether the first list of each kind was read."""
        ends = time.monotonic() + deadline_s
        return all(reflector.wait_synced(max(0.0, ends - time.monotonic())) for reflector in self._all())

    def missing(self) -> tuple[str, ...]:
        """Return the plural names of the kinds whose first list was not read yet."""
        return tuple(reflector.plural for reflector in self._all() if not reflector.synced)

    def known(self) -> Collection[Key]:
        """Return the keys of all TrainingJobs."""
        return self._jobs.keys()

    def training_job(self, key: Key) -> Object | None:
        """Return a TrainingJob; None if it does not exist or is being deleted."""
        found = self._jobs.get(*key)
        return None if found is None or "deletionTimestamp" in found["metadata"] else found

    def children(self, resource: Resource, key: Key) -> list[Object]:
        """Return the objects of a kind with the label of a TrainingJob."""
        namespace, name = key
        return self._children[resource.plural].select(namespace, {JOB_LABEL: name})

    def phases(self) -> Iterable[tuple[str, str]]:
        """Return namespace and phase of each TrainingJob."""
        return tuple((namespace, phase) for (namespace, _), phase in tuple(self._phases.items()))

    def waits(self) -> Iterable[tuple[str, str]]:
        """Return namespace and reason of each replica that waits."""
        waiting = tuple(self._waits.items())
        return tuple((namespace, reason) for (namespace, _), reasons in waiting for reason in reasons)

    def trainers(self) -> Collection[PollTarget]:
        """Return the running trainers."""
        return self._trainers.targets()

    def _all(self) -> tuple[Informer, ...]:
        return (self._jobs, *self._children.values())

    def _job_changed(self, obj: Object) -> None:
        key = (obj["metadata"]["namespace"], obj["metadata"]["name"])
        exists = self._jobs.holds(*key)
        if exists:
            self._phases[key] = (obj.get("status") or {}).get("phase") or Phase.PENDING.value
        else:
            self._phases.pop(key, None)
        self._waits.pop(key, None)
        if exists and (waiting := waits(obj)):
            self._waits[key] = waiting
        self._trainers.training_job(obj, exists=exists)
        self._changed(key)

    def _child_changed(self, resource: Resource, child: Object) -> None:
        namespace, name = child["metadata"]["namespace"], child["metadata"]["name"]
        exists = self._children[resource.plural].holds(namespace, name)
        if resource is PODS:
            self._trainers.pod(child, exists=exists)
        elif resource is JOBS:
            self._trainers.job(child, exists=exists)
        self._changed((namespace, child["metadata"]["labels"][JOB_LABEL]))


def waits(job: Object) -> tuple[str, ...]:
    """Return the waiting reason of each replica that is pending, or that runs but has done no step yet."""
    return tuple(
        text(replica, "reason")
        for replica in parts(job, "status", "replicas")
        if text(replica, "reason") in _WAITING and _before_training(replica)
    )


def _before_training(replica: Object) -> bool:
    phase = text(replica, "phase")
    return phase == Phase.PENDING or (phase == Phase.RUNNING and count(replica, "step") == 0)
