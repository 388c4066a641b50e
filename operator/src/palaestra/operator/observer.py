"""Observe one TrainingJob, from the caches and by requests to the API server.

Some facts are needed too rarely for a watch. The operator requests these facts only while a job needs them:

- the objects to which the job refers by name, and whether the cluster has Kueue;
- the reasons for which the job's pods cannot be created or Kueue does not admit the job;
- a Job of another owner that has the name of one of the TrainingJob's Jobs.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from palaestra.api import TrainingJob
from palaestra.cluster import Api, Forbidden, NotFound
from palaestra.cluster.resources import (
    CLAIMS,
    CONFIG_MAPS,
    JOBS,
    NETWORK_POLICIES,
    PODS,
    SECRETS,
    TRAINING_JOBS,
)
from palaestra.decide import complete, lacking_claims, resuming
from palaestra.objects import Key
from palaestra.observe import (
    Objects,
    Observed,
    Polled,
    Raw,
    ReferencedObject,
    ReferenceKind,
    observe,
    references,
    whole,
)
from palaestra.operator.caches import Caches
from palaestra.operator.preconditions import Outdated
from palaestra.operator.unwatched_facts import (
    ForeignJobs,
    KueueWorkloads,
    PodEvents,
    RejectedCreations,
    SuspendManagers,
)
from palaestra.operator.world_verdicts import WorldChecker
from palaestra.plan import GivenWorld

RECHECK_S = 10.0  # seconds between two requests for an object that may be missing
KUEUE = "kueue.x-k8s.io"
KUEUE_S = 10.0  # seconds between two checks whether the cluster serves Kueue's API

_READ = {
    ReferenceKind.CONFIG_MAP: CONFIG_MAPS,
    ReferenceKind.SECRET: SECRETS.only_metadata(),
    ReferenceKind.CLAIM: CLAIMS.only_metadata(),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Seen:
    """The observation of a TrainingJob; `again_s`: seconds until unwatched facts must be requested again."""

    observed: Observed
    again_s: float | None


class JobObserver:
    """Observes TrainingJobs.

    Args:
        api: the cluster.
        caches: the watched objects.
        strangers: the foreign Jobs, which belong to other owners and have names that this operator's Jobs
            need.
        denials: refused creations.
        polled: returns the responses of the trainers, by the uids of their pods.
        checking: checks the worlds of jobs.
    """

    def __init__(
        self,
        api: Api,
        caches: Caches,
        strangers: ForeignJobs,
        denials: RejectedCreations,
        polled: Callable[[], Mapping[str, Polled]],
        checking: WorldChecker,
    ) -> None:
        self._api = api
        self._caches = caches
        self._strangers = strangers
        self._denials = denials
        self._polled = polled
        self._checking = checking
        self._pod_events = PodEvents(api)
        self._admissions = KueueWorkloads(api)
        self._switchers = SuspendManagers(api)
        self._kueue = (-KUEUE_S, False)

    def look(self, job: TrainingJob) -> Seen:
        """Return the observation of a job.

        Raises:
            ApiError: a request to the API server failed.
        """
        key, uid = (job.metadata.namespace, job.metadata.name), job.metadata.uid or ""
        jobs, pods = self._caches.children(JOBS, key), self._caches.children(PODS, key)
        strangers = self._strangers.among(key, uid, {job["metadata"]["name"] for job in jobs})
        pod_events = self._pod_events.of(key, uid, jobs, pods)
        admissions = self._admissions.of(key, uid, jobs, pods)
        objects = Objects(
            jobs=[*jobs, *strangers],
            pods=pods,
            claims=self._caches.children(CLAIMS, key),
            config_maps=self._caches.children(CONFIG_MAPS, key),
            policies=self._caches.children(NETWORK_POLICIES, key),
            events=list(pod_events.facts.values()),
            unadmitted=admissions.facts,
            unasked=admissions.unasked | {key for key, _ in pod_events.unasked},
            polled=self._polled(),
            denied=self._denials.known(key, uid),
            switchers=self._switchers.of(key, uid, job, jobs),
        )
        found, lost_s = self._with_claims(job, observe(job, objects))
        observed, asked_s = self._asked(job, found)
        met_s = RECHECK_S if strangers else None
        return Seen(
            observed=observed,
            again_s=earliest(pod_events.again_s, admissions.again_s, asked_s, met_s, lost_s),
        )

    def ask_for(self, job: TrainingJob, seen: Seen) -> Seen:
        """Return the observation completed with all objects to which the whole job refers.

        Raises:
            ApiError: a request failed.
        """
        observed, asked_s = self._asked(job, seen.observed)
        return replace(seen, observed=observed, again_s=earliest(seen.again_s, asked_s))

    def whole(self, raw: Raw) -> Raw:
        """Return the whole TrainingJob of a trimmed, cached copy; it is read from the API server.

        Raises:
            ApiError: a request failed.
            Outdated: the TrainingJob has changed since the copy was made.
        """
        metadata = raw["metadata"]
        try:
            found = whole(self._api.get(TRAINING_JOBS, metadata["namespace"], metadata["name"]))
        except NotFound:
            found = None
        if found is None or found["metadata"]["resourceVersion"] != metadata["resourceVersion"]:
            raise Outdated("the cached TrainingJob differs from the cluster's, so nothing was planned")
        return found

    def forget(self, key: Key) -> None:
        """Drop all facts about a deleted TrainingJob."""
        parts = (self._strangers, self._denials, self._pod_events, self._admissions, self._switchers)
        for part in (*parts, self._checking):
            part.forget(key)

    def with_verdicts(self, job: TrainingJob, seen: Seen, worlds: Sequence[GivenWorld]) -> Seen:
        """Return the observation completed with the known results of the checks of the job's worlds."""
        key = (job.metadata.namespace, job.metadata.name)
        if seen.observed.worlds_wait:
            return seen
        verdicts = self._checking.verdicts(key, worlds)
        return replace(seen, observed=replace(seen.observed, verdicts=verdicts))

    def _with_claims(self, job: TrainingJob, observed: Observed) -> tuple[Observed, float | None]:
        """Return the observation completed with the claims of trained replicas that are not in the caches.

        A claim that a person restored may lack the operator's labels, and is then not in the caches.
        """
        lacking, namespace = lacking_claims(job, observed), job.metadata.namespace
        claims = [ReferencedObject(kind=ReferenceKind.CLAIM, name=name) for name in lacking]
        found = {
            (claim.kind.value, claim.name) for claim in claims if self._source(namespace, claim) is not None
        }
        present = observed.present | found
        return replace(observed, present=present), RECHECK_S if lacking else None

    def _asked(self, job: TrainingJob, observed: Observed) -> tuple[Observed, float | None]:
        """Return the observation completed by requests, and the seconds until the next requests."""
        if complete(job, observed) and not resuming(job, observed):
            return observed, None
        key = (job.metadata.namespace, job.metadata.name)
        if self._checking.waits(key) and not resuming(job, observed):
            return replace(observed, worlds_wait=True), None  # the end of the check queues the job again
        namespace, queued = job.metadata.namespace, job.spec.scheduling.queue_name is not None
        sources = {reference: self._source(namespace, reference) for reference in references(job)}
        kueue = queued and self._has_kueue()
        again_s = RECHECK_S if sources or (queued and not kueue) else None
        return replace(observed, sources=sources, kueue=kueue), again_s

    def _source(self, namespace: str, source: ReferencedObject) -> Raw | None:
        try:
            return self._api.get(_READ[source.kind], namespace, source.name)
        except NotFound:
            return None
        except Forbidden:
            if source.kind is not ReferenceKind.SECRET:
                raise
            # The operator has no permission to read Secrets in this namespace. So it treats the Secret like
            # a Secret without the label that allows jobs to use a Secret.
            return {}

    def _has_kueue(self) -> bool:
        at, found = self._kueue
        if time.monotonic() - at >= KUEUE_S:
            found = self._api.serves(KUEUE)
            self._kueue = (time.monotonic(), found)
        return found


def earliest(*seconds: float | None) -> float | None:
    """Return the shortest of several waits; None if all are None."""
    return min((second for second in seconds if second is not None), default=None)
