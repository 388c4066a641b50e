"""Delete the claims of deleted TrainingJobs, if no volume was ever bound to them.

With `retain: Keep`, a claim outlives its TrainingJob, because its volume stores the run. Such a claim has no
owner, so the garbage collector does not delete it. If it was never bound, it stores no run, but counts
against quotas forever. A claim could have an owner reference until it is bound. But if the operator did not
remove this reference in time, the garbage collector would delete the run together with the job.
"""

import structlog

from palaestra.cluster import Api, NotFound
from palaestra.cluster.resources import CLAIMS, TRAINING_JOBS
from palaestra.objects import Key
from palaestra.observe.claims import is_unused
from palaestra.operator.caches import Caches
from palaestra.operator.fenced_client import FencedClient
from palaestra.plan.replica import UID_LABEL

log = structlog.get_logger(__name__)


class UnusedClaims:
    """Deletes unused claims.

    Args:
        api: the cluster, for reads that must not come from a cache.
        caches: the watched objects.
        writer: the client that deletes claims.
    """

    def __init__(self, api: Api, caches: Caches, writer: FencedClient) -> None:
        self._api = api
        self._caches = caches
        self._writer = writer

    def tidy(self, key: Key) -> None:
        """Delete the unused claims of earlier TrainingJobs of this name.

        Raises:
            ApiError: a request failed, or a claim has changed since it was cached; reconcile again.
            NotLeading: another operator may lead.
        """
        job = self._caches.training_job(key)
        uid = job["metadata"]["uid"] if job is not None else None
        claims = [claim["metadata"] for claim in self._caches.children(CLAIMS, key) if is_unused(claim)]
        left = [metadata for metadata in claims if metadata["labels"].get(UID_LABEL) not in {None, uid}]
        current = self._uid(key) if left else None
        for metadata in left:
            if metadata["labels"][UID_LABEL] != current:
                self._delete(key, metadata["name"], metadata["uid"], metadata["resourceVersion"])

    def _uid(self, key: Key) -> str | None:
        """Return the uid of the TrainingJob in the API server; None if it does not exist."""
        try:
            return str(self._api.get(TRAINING_JOBS.only_metadata(), *key)["metadata"]["uid"])
        except NotFound:
            return None

    def _delete(self, key: Key, name: str, uid: str, version: str) -> None:
        try:
            self._writer.delete(CLAIMS, key[0], name, uid=uid, version=version)
        except NotFound:
            return
        log.info("deleted", job=key, kind=CLAIMS.kind, name=name)
