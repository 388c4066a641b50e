"""The control loop: compare the cluster with the job, and change the cluster one step toward the job.

The loop is level-triggered: a reconcile gets the key of a job, not the change. A reconcile derives the job's
state from the cluster alone, so the operator can be killed between any two writes and restarted. The pure
package `palaestra.decide` chooses the actions and the status. This module builds no objects.
"""

import threading
import time
from collections.abc import Callable
from datetime import UTC, datetime

import structlog

from palaestra.api import TrainingJob
from palaestra.cluster import NamespaceTerminating
from palaestra.decide import (
    Decision,
    JobRefused,
    ReconcileRecord,
    Times,
    accept,
    decide,
    managed_here,
    prepare,
    reject,
    wants_whole,
    worlds_to_check,
)
from palaestra.objects import Key, Object
from palaestra.observe import lacking, trimmed
from palaestra.observe.json_access import part
from palaestra.operator.caches import Caches
from palaestra.operator.executor import Executor
from palaestra.operator.observer import JobObserver, Seen, earliest
from palaestra.operator.status_writer import StatusWrite, StatusWriter
from palaestra.plan import ClusterLayout

log = structlog.get_logger(__name__)


class ReconcileRecords:
    """The record of each TrainingJob's last reconcile, in memory only; safe to use from several threads.

    A TrainingJob that was deleted and created again has another uid, and so starts with an empty record.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._known: dict[Key, tuple[str, ReconcileRecord]] = {}

    def of(self, key: Key, uid: str) -> ReconcileRecord:
        """Return the record of the job with this uid, or an empty record."""
        with self._lock:
            known_uid, record = self._known.get(key, (uid, ReconcileRecord()))
        return record if known_uid == uid else ReconcileRecord()

    def keep(self, key: Key, uid: str, record: ReconcileRecord) -> None:
        """Store the record of a reconcile."""
        with self._lock:
            self._known[key] = (uid, record)

    def forget(self, key: Key) -> None:
        """Drop the record of a job that no longer exists."""
        with self._lock:
            self._known.pop(key, None)

    def clear(self) -> None:
        """Drop all records."""
        with self._lock:
            self._known.clear()


def now(record: ReconcileRecord) -> Times:
    """Return the current time by both clocks; `record` is the record of the last reconcile."""
    return Times(now=datetime.now(UTC), clock_s=time.monotonic(), record=record)


class Controller:
    """Reconciles TrainingJobs; only one worker at a time may reconcile a job.

    Args:
        caches: the watched objects.
        looking: reads the current state of a job's objects and trainers.
        acting: executes the actions of a decision.
        reporting: writes the job's status, then its events.
        layout: the layout of this release in this cluster.
        times: returns the clocks of a reconcile; its argument is the record of the last reconcile.
    """

    def __init__(
        self,
        caches: Caches,
        looking: JobObserver,
        acting: Executor,
        reporting: StatusWriter,
        layout: ClusterLayout,
        times: Callable[[ReconcileRecord], Times] = now,
    ) -> None:
        self._caches = caches
        self._looking = looking
        self._acting = acting
        self._reporting = reporting
        self._layout = layout
        self._times = times
        self._records = ReconcileRecords()
        self._terminating: set[Key] = set()  # jobs for which "namespace terminates" was logged

    def begin_anew(self) -> None:
        """Drop all records, which restarts all waiting times: another operator may have led meanwhile."""
        self._records.clear()

    def reconcile(self, key: Key) -> float | None:
        """Reconcile one TrainingJob: observe, decide, act, report.

        If this reconcile's status accepts the job, a second decision follows at once and creates the job's
        objects.

        Returns:
            The seconds after which the decision may change by time alone; None: never.

        Raises:
            ApiError: a request failed, so retry later; completed actions stay. If the namespace is being
                deleted, this error is not raised, because each change in the namespace triggers a reconcile
                anyway.
            Outdated: the cache is behind.
            NotLeading: another operator may lead.
        """
        raw = self._caches.training_job(key)
        if raw is None or not managed_here(raw):
            self._forget(key)
            return None
        try:
            times = self._times(self._records.of(key, raw["metadata"]["uid"]))
            try:
                job, seen = self._observe(raw)
            except JobRefused as refused:
                decision = reject(raw, refused, times.now)
                return earliest(decision.wake_after_s, self._carry_out(raw, decision, times).again_s)
            prepared = prepare(job, seen.observed, self._layout)
            decision = decide(job, seen.observed, prepared, times)
            written = self._carry_out(raw, decision, times)
            if written.stored is not None and _just_accepted(raw, written.stored):
                decision = decide(accept(written.stored), seen.observed, prepared, times)
                written = self._carry_out(trimmed(written.stored), decision, times, confirmed=True)
            return earliest(decision.wake_after_s, seen.again_s, written.again_s)
        except NamespaceTerminating as error:
            self._log_once(key, error)
            return None

    def _observe(self, raw: Object) -> tuple[TrainingJob, Seen]:
        """Return a job and its observation; a job that must be planned is read whole from the API server.

        Raises:
            JobRefused: the operator cannot run the job as it is.
        """
        job = accept(raw)
        seen = self._looking.look(job)
        if wants_whole(job, seen.observed, self._layout, lacking(raw)):
            job = accept(self._looking.whole(raw))
            seen = self._looking.ask_for(job, seen)
        return job, self._looking.with_verdicts(job, seen, worlds_to_check(job, seen.observed, self._layout))

    def _carry_out(
        self, raw: Object, decision: Decision, times: Times, *, confirmed: bool = False
    ) -> StatusWrite:
        """Execute the actions, then write the status and the events.

        `confirmed`: this reconcile's status accepts the job, so its objects are created without a confirming
        read.
        """
        key = (raw["metadata"]["namespace"], raw["metadata"]["name"])
        self._records.keep(key, raw["metadata"]["uid"], decision.record)
        denied = self._acting.carry_out(raw, decision.actions, confirmed=confirmed)
        written = self._reporting.report(raw, decision, denied, times.clock_s)
        if denied:
            raise next(iter(denied.values()))
        return written

    def _log_once(self, key: Key, error: NamespaceTerminating) -> None:
        """Log that the namespace of a job is being deleted."""
        if key not in self._terminating:
            self._terminating.add(key)
            log.info("namespace terminates", job=key, error=str(error))

    def _forget(self, key: Key) -> None:
        """Drop all memory of a job that no longer exists or that another controller manages."""
        self._looking.forget(key)
        self._reporting.forget(key)
        self._records.forget(key)
        self._terminating.discard(key)


def _just_accepted(before: Object, stored: Object) -> bool:
    """Return whether the written status accepts its job, so that all its objects can be created at once.

    A job that was not accepted has never had a pod, so its creations need no confirming read. A job with an
    `existingClaim` is different: a pod of an earlier job may still write to the claim. For such a job the
    result is False, and the next reconcile checks the pods before it creates the objects.
    """
    accepted = part(stored, "status").get("release") and not part(before, "status").get("release")
    return bool(accepted) and part(stored, "spec", "storage").get("existingClaim") is None
