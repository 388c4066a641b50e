"""Reasons for which pods of a Job cannot be created, cannot start or were ended: a quota, volume or probe.

Only events report this, and a watch of all events in a cluster is expensive. So the operator lists them
(`palaestra.operator.rate_limited_lookup`) if a Job has no pod although it should, or if a pod waits for its
volumes. It also lists them if a signal ended a trainer and the pod does not show the cause.
"""

import time
from collections.abc import Callable, Iterator, Sequence

from palaestra.cluster import Api
from palaestra.cluster.resources import EVENTS
from palaestra.objects import Key, Object
from palaestra.observe import last_hindrance, was_signalled
from palaestra.observe.json_access import holds, owners
from palaestra.operator.rate_limited_lookup import Answers, RateLimitedLookup

Lacking = tuple[str, str]  # uid of a Job or pod, and a selector for the events with the reason


class PodEvents(RateLimitedLookup[Lacking, Object]):
    """The last event about each Job without a pod, pod without its volumes, or trainer ended by a signal.

    Args:
        api: the cluster.
        clock: a monotonic clock, in seconds.
    """

    def __init__(self, api: Api, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__(self._event, clock)
        self._api = api

    def of(
        self, key: Key, uid: str, jobs: Sequence[Object], pods: Sequence[Object]
    ) -> Answers[Lacking, Object]:
        """Return the events about those of a TrainingJob's `jobs` and `pods` that need an explanation.

        Raises:
            ApiError: the read of events failed.
        """
        return self.about(key, uid, list(_lacking(jobs, pods)))

    def _event(self, namespace: str, lacking: Lacking) -> Object | None:
        uid, about = lacking
        found = self._api.list(EVENTS, namespace, fields=f"involvedObject.uid={uid},{about}")
        return last_hindrance(found, uid)


def podless(jobs: Sequence[Object], pods: Sequence[Object]) -> Iterator[Object]:
    """Yield the unfinished Jobs that have no unfinished pod."""
    served = {owner for pod in pods if _alive(pod) for owner in owners(pod)}
    for job in jobs:
        ended = holds(job, "Complete") or holds(job, "Failed")
        if job["metadata"]["uid"] not in served and not ended and "deletionTimestamp" not in job["metadata"]:
            yield job


def is_suspended(job: Object) -> bool:
    """Return whether a Job is suspended; a suspended Job does not create pods."""
    return (job.get("spec") or {}).get("suspend") is True


def _lacking(jobs: Sequence[Object], pods: Sequence[Object]) -> Iterator[Lacking]:
    for job in podless(jobs, pods):
        if not is_suspended(job):
            yield job["metadata"]["uid"], "reason=FailedCreate"
    for pod in pods:
        if _wants_volumes(pod):
            yield pod["metadata"]["uid"], "type=Warning"
    for pod in _newest_of(jobs, pods):
        if was_signalled(pod):
            yield pod["metadata"]["uid"], "reason=Killing"


def _newest_of(jobs: Sequence[Object], pods: Sequence[Object]) -> Iterator[Object]:
    """Yield the newest pod of each Job that has not ended; the status already has the end of an older pod."""
    for job in jobs:
        if holds(job, "Complete") or holds(job, "Failed"):
            continue
        own = (pod for pod in pods if job["metadata"]["uid"] in owners(pod))
        newest = max(own, key=lambda pod: pod["metadata"].get("creationTimestamp", ""), default=None)
        if newest is not None:
            yield newest


def _wants_volumes(pod: Object) -> bool:
    """Return whether a pod's node has not started a container of it yet, so its volumes may be missing."""
    waits = (pod.get("status") or {}).get("phase") == "Pending" and not holds(
        pod, "PodReadyToStartContainers"
    )
    taken = bool((pod.get("spec") or {}).get("nodeName"))
    return taken and waits and "deletionTimestamp" not in pod["metadata"]


def _alive(pod: Object) -> bool:
    return (pod.get("status") or {}).get("phase") not in {"Succeeded", "Failed"}
