"""Why the pods of a Job cannot be made: a quota, a LimitRange, Pod Security, a webhook.

Nothing but the Job's events tells. They are asked for only when a Job that should have a pod has had
none for some seconds, and then now and then: a watch over the events of a whole cluster is dear.
"""

import threading
import time
from collections.abc import Callable, Sequence
from typing import Any

from palaestra.cluster import Api
from palaestra.cluster.resources import EVENTS
from palaestra.observe.reading import holds, owners

PATIENCE_S = 5.0  # that a Job may be without a pod
RECHECK_S = 15.0

Object = dict[str, Any]


class Refusals:
    """FailedCreate events of Jobs without pods; safe to use from several threads.

    Args:
        api: the cluster.
        clock: seconds that never go back.
    """

    def __init__(self, api: Api, clock: Callable[[], float] = time.monotonic) -> None:
        self._api = api
        self._clock = clock
        self._lock = threading.Lock()
        self._without: dict[str, float] = {}  # by uid of the Job: since when it was seen without a pod
        self._asked: dict[str, tuple[float, list[Object]]] = {}

    def of(self, jobs: Sequence[Object], pods: Sequence[Object]) -> tuple[list[Object], float | None]:
        """Return the events about those of `jobs` that lack a pod, and seconds until it is time to ask again.

        None instead of the seconds when no Job lacks one.
        """
        found: list[Object] = []
        again_s: float | None = None
        served = {owner for pod in pods if _alive(pod) for owner in owners(pod)}
        for job in jobs:
            uid = job["metadata"]["uid"]
            if uid in served or not _wants_pod(job):
                self._forget(uid)
                continue
            wait_s = self._wait_s(uid)
            if wait_s <= 0:
                found += self._events(job)
            again_s = min(again_s or RECHECK_S, wait_s if wait_s > 0 else RECHECK_S)
        return found, again_s

    def _wait_s(self, uid: str) -> float:
        """Return the seconds of patience that are left for a Job without a pod."""
        now = self._clock()
        with self._lock:
            return self._without.setdefault(uid, now) + PATIENCE_S - now

    def _events(self, job: Object) -> list[Object]:
        uid, namespace = job["metadata"]["uid"], job["metadata"]["namespace"]
        with self._lock:
            at, events = self._asked.get(uid, (-RECHECK_S, []))
        if self._clock() - at >= RECHECK_S:
            fields = f"involvedObject.uid={uid},reason=FailedCreate"
            events = self._api.list(EVENTS, namespace, fields=fields)
            with self._lock:
                self._asked[uid] = (self._clock(), events)
        return events

    def _forget(self, uid: str) -> None:
        with self._lock:
            self._without.pop(uid, None)
            self._asked.pop(uid, None)


def _wants_pod(job: Object) -> bool:
    ended = holds(job, "Complete") or holds(job, "Failed")
    suspended = (job.get("spec") or {}).get("suspend") is True
    return not ended and not suspended and "deletionTimestamp" not in job["metadata"]


def _alive(pod: Object) -> bool:
    return (pod.get("status") or {}).get("phase") not in {"Succeeded", "Failed"}
