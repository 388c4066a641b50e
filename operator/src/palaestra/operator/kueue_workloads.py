"""Kueue's reason not to admit a Job: the message of its Workload, which a job's author may be unable to read.

A Workload is as large as a pod's template, and Kueue changes it often. So the operator does not watch
Workloads; it lists the one of each waiting Job (`palaestra.operator.rate_limited_lookup`). Thousands of Jobs
may wait for days, so their requests and their memory are separate from those for Jobs whose pods are refused.
"""

import time
from collections.abc import Callable, Sequence

from palaestra.cluster import Api, Forbidden, NotFound
from palaestra.cluster.resources import WORKLOADS
from palaestra.objects import Key, Object
from palaestra.observe import why_not_admitted
from palaestra.operator.pod_events import is_suspended, podless
from palaestra.operator.rate_limited_lookup import Answers, RateLimitedLookup
from palaestra.plan.job import QUEUE_LABEL

JOB_UID_LABEL = "kueue.x-k8s.io/job-uid"  # of a Workload; Kueue's pkg/controller/constants/constants.go


class KueueWorkloads(RateLimitedLookup[str, str]):
    """The message of the Workload of each Job that waits in a queue, by the Job's uid.

    Args:
        api: the cluster.
        clock: a monotonic clock, in seconds.
    """

    def __init__(self, api: Api, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__(self._words, clock)
        self._api = api

    def of(self, key: Key, uid: str, jobs: Sequence[Object], pods: Sequence[Object]) -> Answers[str, str]:
        """Return the messages for those of a TrainingJob's `jobs` that wait in a queue.

        Raises:
            ApiError: the read of a Workload failed.
        """
        return self.about(key, uid, [job["metadata"]["uid"] for job in podless(jobs, pods) if _waits(job)])

    def _words(self, namespace: str, uid: str) -> str:
        try:
            return why_not_admitted(self._api.list(WORKLOADS, namespace, labels=f"{JOB_UID_LABEL}={uid}"))
        except (Forbidden, NotFound):  # a role without Workloads, or a Kueue without this version
            return ""


def _waits(job: Object) -> bool:
    return is_suspended(job) and bool((job["metadata"].get("labels") or {}).get(QUEUE_LABEL))
