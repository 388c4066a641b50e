"""Why the pods of a Job cannot be made, or cannot start: a quota, a webhook, a volume that does not come.

Nothing but events tells. They are asked for only when a Job that should have a pod has had none for some
seconds, or a pod has waited as long for its volumes, and then now and then: a watch over the events of a
whole cluster is dear.
"""

import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from palaestra.cluster import Api
from palaestra.cluster.resources import EVENTS
from palaestra.observe.reading import holds, owners

PATIENCE_S = 5.0  # that a Job may be without a pod, or a pod without its volumes
RECHECK_S = 15.0
REMEMBERED = 1000  # objects that lack something; what was deleted meanwhile is among them

Object = dict[str, Any]


@dataclass(slots=True)
class _Lack:
    """Since when an object lacks something, and what was said of it when."""

    since: float
    asked: float | None = None
    events: list[Object] = field(default_factory=list)


class Refusals:
    """Events about Jobs without pods and pods without volumes; safe to use from several threads.

    Args:
        api: the cluster.
        clock: seconds that never go back.
    """

    def __init__(self, api: Api, clock: Callable[[], float] = time.monotonic) -> None:
        self._api = api
        self._clock = clock
        self._lock = threading.Lock()
        self._lacks: OrderedDict[str, _Lack] = OrderedDict()  # by uid

    def of(self, jobs: Sequence[Object], pods: Sequence[Object]) -> tuple[list[Object], float | None]:
        """Return the events about those of `jobs` and `pods` that lack something, and when to ask again.

        That is in seconds; None when nothing is lacking.
        """
        found: list[Object] = []
        again_s: float | None = None
        lacking = dict(_lacking(jobs, pods))
        self._forget({each["metadata"]["uid"] for each in (*jobs, *pods)} - lacking.keys())
        for uid, (obj, about) in lacking.items():
            wait_s = self._wait_s(uid)
            if wait_s <= 0:
                found += self._events(uid, obj["metadata"]["namespace"], about)
            again_s = min(again_s or RECHECK_S, wait_s if wait_s > 0 else RECHECK_S)
        return found, again_s

    def _wait_s(self, uid: str) -> float:
        """Return the seconds of patience that are left for an object that lacks something."""
        now = self._clock()
        with self._lock:
            lack = self._lacks.setdefault(uid, _Lack(since=now))
            if len(self._lacks) > REMEMBERED:
                self._lacks.popitem(last=False)
            return lack.since + PATIENCE_S - now

    def _events(self, uid: str, namespace: str, about: str) -> list[Object]:
        with self._lock:
            lack = self._lacks.get(uid) or _Lack(since=self._clock())
        if lack.asked is None or self._clock() - lack.asked >= RECHECK_S:
            lack.events = self._api.list(EVENTS, namespace, fields=f"involvedObject.uid={uid},{about}")
            lack.asked = self._clock()
        return lack.events

    def _forget(self, uids: set[str]) -> None:
        with self._lock:
            for uid in uids:
                self._lacks.pop(uid, None)


def _lacking(jobs: Sequence[Object], pods: Sequence[Object]) -> Iterator[tuple[str, tuple[Object, str]]]:
    """Yield the uid of each object that lacks something, with it and which of its events would tell."""
    served = {owner for pod in pods if _alive(pod) for owner in owners(pod)}
    for job in jobs:
        if job["metadata"]["uid"] not in served and _wants_pod(job):
            yield job["metadata"]["uid"], (job, "reason=FailedCreate")
    for pod in pods:
        if _wants_volumes(pod):
            yield pod["metadata"]["uid"], (pod, "type=Warning")


def _wants_pod(job: Object) -> bool:
    ended = holds(job, "Complete") or holds(job, "Failed")
    suspended = (job.get("spec") or {}).get("suspend") is True
    return not ended and not suspended and "deletionTimestamp" not in job["metadata"]


def _wants_volumes(pod: Object) -> bool:
    """Return whether a node has taken a pod and not begun with its containers: volumes come before."""
    waits = (pod.get("status") or {}).get("phase") == "Pending" and not holds(
        pod, "PodReadyToStartContainers"
    )
    taken = bool((pod.get("spec") or {}).get("nodeName"))
    return taken and waits and "deletionTimestamp" not in pod["metadata"]


def _alive(pod: Object) -> bool:
    return (pod.get("status") or {}).get("phase") not in {"Succeeded", "Failed"}
