"""Why the pods of a Job cannot be made, or cannot start: a quota, a webhook, a volume that does not come.

Only events report it. They are asked for only when a Job that should have a pod has had none for some
seconds, or a pod has waited as long for its volumes, and then at growing pauses: a watch over the events of
a whole cluster is dear. All objects together share a few requests a second and a bounded memory, so that a
namespace whose pods are all refused takes nothing from the others.
"""

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from palaestra.cluster import Api
from palaestra.cluster.resources import EVENTS
from palaestra.observe import last_refusal
from palaestra.observe.reading import holds, owners
from palaestra.operator.memory import Memory
from palaestra.operator.poller import Key

PATIENCE_S = 5.0  # that a Job may be without a pod, or a pod without its volumes
RECHECK_S = 15.0  # between the first two requests about an object; each pause is twice the one before
LONGEST_PAUSE_S = 300.0
RATE = 4.0  # requests a second, about all objects together; with the one that is saved up, 5 in any second

Object = dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Told:
    """What is known of objects that lack something.

    Attributes:
        events: the last event about each.
        unasked: uids of those about which nobody is asked, as there are too many.
        again_s: when to look again; None: nothing is lacking.
    """

    events: tuple[Object, ...] = ()
    unasked: frozenset[str] = frozenset()
    again_s: float | None = None


@dataclass(slots=True)
class _Lack:
    """What an object lacks: when to ask (again), and the last event about it."""

    due: float
    pause_s: float = RECHECK_S
    queued: bool = False
    event: Object | None = None


class Refusals(Memory[str, _Lack]):
    """Events about Jobs without pods and pods without volumes, by TrainingJob and uid.

    Args:
        api: the cluster.
        clock: seconds that never go back.
    """

    def __init__(self, api: Api, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._api = api
        self._clock = clock
        self._turns = _Turns(clock())

    def of(self, key: Key, uid: str, jobs: Sequence[Object], pods: Sequence[Object]) -> Told:
        """Return what is known about those of a TrainingJob's `jobs` and `pods` that lack something."""
        lacking, known = dict(_lacking(jobs, pods)), self.known(key, uid)
        due = self._clock() + PATIENCE_S
        kept = self.keep(key, uid, {each: known.get(each) or _Lack(due) for each in lacking})
        for each, lack in kept.items():
            if self._is_due(lack):
                self._ask(lack, each, key[0], lacking[each])
        unasked = frozenset(lacking.keys() - kept.keys())
        waits_s = [max(lack.due - self._clock(), 0.0) for lack in kept.values()]
        return Told(
            events=tuple(lack.event for lack in kept.values() if lack.event is not None),
            unasked=unasked,
            again_s=min([*waits_s, *(LONGEST_PAUSE_S for _ in unasked)], default=None),
        )

    def _is_due(self, lack: _Lack) -> bool:
        """Return whether to ask now; if so, the pause after that has begun."""
        now = self._clock()
        if now < lack.due:
            return False
        wait_s = self._turns.wait_s(now, queued=lack.queued)
        lack.queued = wait_s > 0
        lack.due = now + (wait_s or lack.pause_s)
        return not lack.queued

    def _ask(self, lack: _Lack, uid: str, namespace: str, about: str) -> None:
        found = self._api.list(EVENTS, namespace, fields=f"involvedObject.uid={uid},{about}")
        lack.event = last_refusal(found, uid)
        lack.pause_s = min(lack.pause_s * 2, LONGEST_PAUSE_S)


class _Turns:
    """Who may ask when: a bucket of one token, and a queue of moments for those that find it empty."""

    def __init__(self, now: float) -> None:
        self._lock = threading.Lock()
        self._tokens, self._filled = 1.0, now
        self._end = now  # of the queue

    def wait_s(self, now: float, *, queued: bool) -> float:
        """Return the seconds after which to come again; 0: this is the turn."""
        with self._lock:
            self._tokens = min(self._tokens + (now - self._filled) * RATE, 1.0)
            self._filled = now
            if not queued and now < self._end:
                wait_s = self._end - now
                self._end += 1 / RATE
                return wait_s
            if self._tokens < 1.0:
                return (1.0 - self._tokens) / RATE
            self._tokens = 0.0
            self._end = max(self._end, now + 1 / RATE)
            return 0.0


def _lacking(jobs: Sequence[Object], pods: Sequence[Object]) -> Iterator[tuple[str, str]]:
    """Yield the uid of each object that lacks something, with a selector of the events that say why."""
    served = {owner for pod in pods if _alive(pod) for owner in owners(pod)}
    for job in jobs:
        if job["metadata"]["uid"] not in served and _wants_pod(job):
            yield job["metadata"]["uid"], "reason=FailedCreate"
    for pod in pods:
        if _wants_volumes(pod):
            yield pod["metadata"]["uid"], "type=Warning"


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
