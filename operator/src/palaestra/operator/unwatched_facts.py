"""Facts that no watch reports, because a watch for them would be expensive and few jobs need them.

Each class stores one type of fact in its own bounded memory, so that many facts of one type do not displace
facts of another type. After a restart the operator requests the facts again.
"""

import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence

from palaestra.api import TrainingJob
from palaestra.api.text import one_line
from palaestra.cluster import Api, ApiError, Forbidden, NotFound, ServerError, TooManyRequests
from palaestra.cluster.resources import EVENTS, JOBS, WORKLOADS
from palaestra.decide.suspend import overruled
from palaestra.objects import Key, Object
from palaestra.observe import Raw, last_blocking_event, trimmed, was_signalled, why_not_admitted
from palaestra.observe.jobs import job_view, suspends
from palaestra.observe.json_access import MOST_TEXT, count, holds, owners
from palaestra.operator.bounded_cache import Answers, BoundedCache, RateLimitedLookup
from palaestra.plan.job import QUEUE_LABEL

RECHECK_S = 10.0  # seconds between two reads of a foreign Job
# Label of a Workload. Source: Kueue's pkg/controller/constants/constants.go.
JOB_UID_LABEL = "kueue.x-k8s.io/job-uid"

Denied = Mapping[int | None, ApiError]  # errors by replica; the key None is for objects of the whole job
Lacking = tuple[str, str]  # uid of a Job or pod, and the field selector of the events to read
Change = tuple[str, int]  # uid and generation of a Job

# If a webhook does not respond, the API server responds with an internal error. The message of this error
# has this word.
_BY_A_WEBHOOK = "webhook"
# If a disruption budget forbids an eviction, the API server responds with 429, as if it were busy. The
# message of this response has these words.
_BY_A_BUDGET = "disruption budget"


class ForeignJobs(BoundedCache[str, tuple[float, Object]]):
    """Each foreign Job with the time of its last read, by TrainingJob and name.

    A foreign Job has a name that a TrainingJob needs, but belongs to an earlier TrainingJob or to another
    owner. The caches may not have it, because it may lack the label of the operator's objects. The operator
    finds a foreign Job when the creation of its own Job fails with "already exists". The operator then reads
    the foreign Job every few seconds until that Job is deleted.

    Args:
        api: the cluster.
        clock: a monotonic clock, in seconds.
    """

    def __init__(self, api: Api, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._api = api
        self._clock = clock

    def meet(self, key: Key, uid: str, name: str) -> Object | None:
        """Return and store the foreign Job whose name a TrainingJob needs; None if it does not exist."""
        others = {other: met for other, met in self.known(key, uid).items() if other != name}
        try:
            found = trimmed(self._api.get(JOBS, key[0], name))
        except NotFound:
            self.keep(key, uid, others)
            return None
        self.keep(key, uid, {**others, name: (self._clock(), found)})
        return found

    def among(self, key: Key, uid: str, cached: Collection[str]) -> list[Object]:
        """Return the foreign Jobs whose names a TrainingJob needs; each was read at most ten seconds ago.

        `cached` has the names of the Jobs in the cache; these Jobs are not foreign.
        """
        met = {name: met for name, met in self.known(key, uid).items() if name not in cached}
        self.keep(key, uid, met)
        for name, (at, _) in met.items():
            if self._clock() - at >= RECHECK_S:
                self.meet(key, uid, name)
        return [found for _, found in self.known(key, uid).values()]


class RejectedCreations(BoundedCache[int | None, str]):
    """The API server's last refusals, by TrainingJob and replica; replica None: an object of the whole job.

    A quota, a webhook or RBAC may refuse an object, and no object in the cluster records the refusal. A
    refusal is stored until the object is created or no longer needed. After a restart the operator tries the
    creation again, and so gets the refusal again.
    """

    def learn(self, key: Key, uid: str, refused: Denied) -> None:
        """Record the refusals of one reconcile; drop older refusals of objects that are not in `refused`.

        A temporary error, such as a busy API server, does not change the record.
        """
        before = self.known(key, uid)
        words = {
            replica: one_line(error.message, MOST_TEXT) if _lasting(error) else before.get(replica, "")
            for replica, error in refused.items()
        }
        self.keep(key, uid, {replica: said for replica, said in words.items() if said})


def _lasting(error: ApiError) -> bool:
    """Return whether a refusal is permanent until a person acts."""
    by_a_webhook = isinstance(error, ServerError) and _BY_A_WEBHOOK in error.message
    by_a_budget = isinstance(error, TooManyRequests) and _BY_A_BUDGET in error.message
    return not error.retryable or by_a_webhook or by_a_budget


class PodEvents(RateLimitedLookup[Lacking, Object]):
    """The last events about Jobs without pods, pods with unmounted volumes, and trainers that a signal ended.

    Only events report that a quota refuses a pod, or that a volume is not mounted. If a signal ended a
    trainer, only events report that the cause was a failed probe.

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
        """Return the events about a TrainingJob's incomplete `jobs` and `pods`.

        Raises:
            ApiError: the read of events failed.
        """
        return self.about(key, uid, list(_lacking(jobs, pods)))

    def _event(self, namespace: str, lacking: Lacking) -> Object | None:
        uid, about = lacking
        found = self._api.list(EVENTS, namespace, fields=f"involvedObject.uid={uid},{about}")
        return last_blocking_event(found, uid)


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
    """Yield the newest pod of each unfinished Job; the status already reports the end of older pods."""
    for job in jobs:
        if holds(job, "Complete") or holds(job, "Failed"):
            continue
        own = (pod for pod in pods if job["metadata"]["uid"] in owners(pod))
        newest = max(own, key=lambda pod: pod["metadata"].get("creationTimestamp", ""), default=None)
        if newest is not None:
            yield newest


def _wants_volumes(pod: Object) -> bool:
    """Return whether a pod has a node but no started container, so that its volumes may be missing."""
    waits = (pod.get("status") or {}).get("phase") == "Pending" and not holds(
        pod, "PodReadyToStartContainers"
    )
    taken = bool((pod.get("spec") or {}).get("nodeName"))
    return taken and waits and "deletionTimestamp" not in pod["metadata"]


def _alive(pod: Object) -> bool:
    return (pod.get("status") or {}).get("phase") not in {"Succeeded", "Failed"}


class KueueWorkloads(RateLimitedLookup[str, str]):
    """The message of the Workload of each Job that waits in a queue, by the Job's uid.

    A job's author may have no permission to read Workloads. A Workload is as large as a pod's template and
    changes often, so a watch would be expensive. The operator lists only the Workloads of waiting Jobs.
    Thousands of Jobs may wait for days, so this lookup has its own rate and memory, separate from
    `PodEvents`.

    Args:
        api: the cluster.
        clock: a monotonic clock, in seconds.
    """

    def __init__(self, api: Api, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__(self._words, clock)
        self._api = api

    def of(self, key: Key, uid: str, jobs: Sequence[Object], pods: Sequence[Object]) -> Answers[str, str]:
        """Return the messages for the Jobs in `jobs` that wait in a queue.

        Raises:
            ApiError: the read of a Workload failed.
        """
        return self.about(key, uid, [job["metadata"]["uid"] for job in podless(jobs, pods) if _waits(job)])

    def _words(self, namespace: str, uid: str) -> str:
        try:
            return why_not_admitted(self._api.list(WORKLOADS, namespace, labels=f"{JOB_UID_LABEL}={uid}"))
        # The operator has no permission to list Workloads, or this release of Kueue does not serve this API
        # version.
        except (Forbidden, NotFound):
            return ""


def _waits(job: Object) -> bool:
    return is_suspended(job) and bool((job["metadata"].get("labels") or {}).get(QUEUE_LABEL))


class SuspendManagers(BoundedCache[Change, str]):
    """The client that suspended or resumed a Job, if it was not the operator, by TrainingJob and change.

    This client is the field manager of `spec.suspend`. The caches do not store managedFields, which are half
    of an object's size. So if `suspend` differs from the operator's last value, the operator reads the Job
    once for each change of the Job's spec.
    """

    def __init__(self, api: Api) -> None:
        super().__init__()
        self._api = api

    def of(self, key: Key, uid: str, job: TrainingJob, jobs: Sequence[Raw]) -> dict[str, str]:
        """Return the field manager by the uid of each Job whose `suspend` differs from the operator's value.

        Raises:
            ApiError: the read of a Job failed.
        """
        ours = ((raw, job_view(raw)) for raw in jobs if uid in owners(raw))
        differ = [(view.uid, raw) for raw, view in ours if overruled(job, view)]
        changed = {(each, count(raw["metadata"], "generation")): raw for each, raw in differ}
        known = self.known(key, uid)
        names = {each: known[each] if each in known else self._name(raw) for each, raw in changed.items()}
        self.keep(key, uid, names)
        return {each: name for (each, _), name in names.items()}

    def _name(self, raw: Raw) -> str:
        metadata = raw["metadata"]
        try:
            return suspends(self._api.get(JOBS.only_metadata(), metadata["namespace"], metadata["name"]))
        except NotFound:  # the cache receives the deletion soon
            return ""
