"""Look at one TrainingJob: what the caches hold of it, and what has to be asked for.

Some things are too rare to be watched by everybody all the time, and are asked for only while a job
waits for them: what it refers to by name, why its pods cannot be made, a Job of somebody else that has
a name of ours, and whether there is a Kueue.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from palaestra.api import TrainingJob
from palaestra.cluster import Api, Forbidden, NotFound
from palaestra.cluster.resources import CLAIMS, CONFIG_MAPS, JOBS, NETWORK_POLICIES, PODS, SECRETS
from palaestra.decide import complete
from palaestra.observe import Objects, Polled, Raw, Source, SourceKind, observe, references
from palaestra.operator.caches import Caches
from palaestra.operator.denials import Denials
from palaestra.operator.poller import Key
from palaestra.operator.refusals import Refusals
from palaestra.operator.strangers import Strangers

RECHECK_S = 10.0  # while something may be missing
KUEUE = "kueue.x-k8s.io"
KUEUE_S = 10.0  # for which an answer about Kueue is believed

_READ = {
    SourceKind.CONFIG_MAP: CONFIG_MAPS,
    SourceKind.SECRET: SECRETS.only_metadata(),
    SourceKind.CLAIM: CLAIMS.only_metadata(),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Seen:
    """What there is of a TrainingJob; `again_s`: when to look anew at what no watch tells."""

    objects: Objects
    again_s: float | None


class Looking:
    """Looks at TrainingJobs.

    Args:
        api: the cluster.
        caches: what is watched.
        strangers: the Jobs of others that were met.
        denials: what could not be created.
        polled: returns what the trainers said, by the pod's uid.
    """

    def __init__(
        self,
        api: Api,
        caches: Caches,
        strangers: Strangers,
        denials: Denials,
        polled: Callable[[], Mapping[str, Polled]],
    ) -> None:
        self._api = api
        self._caches = caches
        self._strangers = strangers
        self._denials = denials
        self._polled = polled
        self._refusals = Refusals(api)
        self._kueue = (-KUEUE_S, False)

    def look(self, job: TrainingJob) -> Seen:
        """Return what there is of a job.

        Raises:
            ApiError: something had to be asked for, and there was no answer.
        """
        key: Key = (job.metadata.namespace, job.metadata.name)
        jobs, pods = self._caches.children(JOBS, key), self._caches.children(PODS, key)
        strangers = self._strangers.among(key, {each["metadata"]["name"] for each in jobs})
        events, refused_s = self._refusals.of(jobs, pods)
        objects = Objects(
            jobs=[*jobs, *strangers],
            pods=pods,
            claims=self._caches.children(CLAIMS, key),
            config_maps=self._caches.children(CONFIG_MAPS, key),
            policies=self._caches.children(NETWORK_POLICIES, key),
            events=events,
            polled=self._polled(),
            denied=self._denials.of(key),
            kueue=job.spec.scheduling.queue_name is not None and self._has_kueue(),
        )
        sources = self._sources(job, objects)
        recheck_s = RECHECK_S if sources or strangers or _lacks_kueue(job, objects) else None
        return Seen(objects=replace(objects, sources=sources), again_s=earliest(refused_s, recheck_s))

    def forget(self, key: Key) -> None:
        """Forget a TrainingJob that is gone."""
        self._strangers.forget(key)
        self._denials.forget(key)

    def _sources(self, job: TrainingJob, objects: Objects) -> dict[Source, Raw | None]:
        """Return what a job refers to, while something of it is still to be planned."""
        named = references(job)
        if not named or complete(job, observe(job, objects)):
            return {}
        return {each: self._source(job.metadata.namespace, each) for each in named}

    def _source(self, namespace: str, source: Source) -> Raw | None:
        try:
            return self._api.get(_READ[source.kind], namespace, source.name)
        except NotFound:
            return None
        except Forbidden:
            if source.kind is not SourceKind.SECRET:
                raise
            return {}  # nobody has bound the role for Secrets here: as good as one without the label

    def _has_kueue(self) -> bool:
        at, found = self._kueue
        if time.monotonic() - at >= KUEUE_S:
            found = self._api.serves(KUEUE)
            self._kueue = (time.monotonic(), found)
        return found


def _lacks_kueue(job: TrainingJob, objects: Objects) -> bool:
    """Return whether a job waits until somebody installs Kueue."""
    queued = job.spec.scheduling.queue_name is not None
    return queued and not objects.kueue and not complete(job, observe(job, objects))


def earliest(*seconds: float | None) -> float | None:
    """Return the least of several waits; None: there is none."""
    return min((each for each in seconds if each is not None), default=None)
