"""The control loop: compare the cluster with the job, and change it one step toward the job.

Level-triggered: a reconcile gets the key of a job, not the change. It reads everything from the cluster, so
the operator can be killed between any two writes and restarted. `palaestra.decide`, which is pure, decides on
actions and status; this module builds no objects.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import UTC, datetime

import structlog

from palaestra.api import TrainingJob
from palaestra.cluster import NamespaceTerminating
from palaestra.decide import (
    Decision,
    JobRefused,
    Prepared,
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
from palaestra.operator.reconcile_state import ReconcileRecords
from palaestra.operator.status_writer import StatusWrite, StatusWriter
from palaestra.plan import ClusterLayout

log = structlog.get_logger(__name__)


def now(record: ReconcileRecord) -> Times:
    """Return the current time by both clocks; `record` is from the last reconcile."""
    return Times(now=datetime.now(UTC), clock_s=time.monotonic(), record=record)


class Controller:
    """Reconciles TrainingJobs; only one worker at a time may reconcile a job.

    Args:
        caches: the watched objects.
        looking: observes a job.
        acting: executes actions.
        reporting: writes status and events.
        layout: the layout of this release in this cluster.
        times: returns the clocks at a reconcile, given the record of the last one.
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
        self._terminating: set[Key] = set()  # jobs whose terminating namespace was logged

    def begin_anew(self) -> None:
        """Restart every wait, because another operator may have led in the meantime."""
        self._records.clear()

    def reconcile(self, key: Key) -> float | None:
        """Reconcile one TrainingJob; return the seconds after which the decision may change by time alone.

        Raises:
            ApiError: a request failed, so retry later; completed actions stay. It is not raised for a
                namespace that is being deleted, because each change in it triggers a reconcile anyway.
            Outdated: the cache is behind.
            NotLeading: another operator may lead.
        """
        raw = self._caches.training_job(key)
        if raw is None or not managed_here(raw):
            self._looking.forget(key)
            self._reporting.forget(key)
            self._records.forget(key)
            self._terminating.discard(key)
            return None
        try:
            return self._bring_closer(key, raw)
        except NamespaceTerminating as error:
            if key not in self._terminating:
                self._terminating.add(key)
                log.info("namespace terminates", job=key, error=str(error))
            return None

    def _bring_closer(self, key: Key, raw: Object) -> float | None:
        """Observe, decide and act; decide and act once more if the status has just accepted the job."""
        times = self._times(self._records.of(key, raw["metadata"]["uid"]))
        look = self._look(raw, times)
        written = self._carry_out(raw, look, times)
        if written.stored is not None and _just_accepted(raw, written.stored):
            look = self._decide_anew(written.stored, look, times)
            written = self._carry_out(trimmed(written.stored), look, times)
        return earliest(look.decision.wake_after_s, look.again_s, written.again_s)

    def _look(self, raw: Object, times: Times) -> "_Look":
        """Return the observation of a job, and the decision on it."""
        try:
            job, seen = self._observe(raw)
        except JobRefused as refused:
            return _Look(decision=reject(raw, refused, times.now))
        seen = self._looking.with_verdicts(job, seen, worlds_to_check(job, seen.observed, self._layout))
        prepared = prepare(job, seen.observed, self._layout)
        decision = decide(job, seen.observed, prepared, times)
        return _Look(decision=decision, seen=seen, prepared=prepared)

    def _decide_anew(self, stored: Object, look: "_Look", times: Times) -> "_Look":
        """Return the decision after the status has accepted the job; no object of the job exists yet."""
        if look.seen is None or look.prepared is None:
            raise AssertionError("unreachable: a refused job is not accepted")
        decision = decide(accept(stored), look.seen.observed, look.prepared, times)
        return replace(look, decision=decision, just_accepted=True)

    def _carry_out(self, raw: Object, look: "_Look", times: Times) -> StatusWrite:
        """Execute the actions, then write the status and the events."""
        key, decision = (raw["metadata"]["namespace"], raw["metadata"]["name"]), look.decision
        self._records.keep(key, raw["metadata"]["uid"], decision.record)
        denied = self._acting.carry_out(raw, decision.actions, confirmed=look.just_accepted)
        written = self._reporting.report(raw, decision, denied, times.clock_s)
        if denied:
            raise next(iter(denied.values()))
        return written

    def _observe(self, raw: Object) -> tuple[TrainingJob, Seen]:
        """Return a job and its observation; the whole job is read if it must be planned.

        Raises:
            JobRefused: the operator cannot run the job as it is.
        """
        job = accept(raw)
        seen = self._looking.look(job)
        if not wants_whole(job, seen.observed, self._layout, lacking(raw)):
            return job, seen
        job = accept(self._looking.whole(raw))
        return job, self._looking.ask_for(job, seen)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Look:
    """The observation of a job and the decision; a refused job has only a decision.

    `just_accepted`: this reconcile has written the status that accepts the job.
    """

    decision: Decision
    seen: Seen | None = None
    prepared: Prepared | None = None
    just_accepted: bool = False

    @property
    def again_s(self) -> float | None:
        """Return the seconds until a fact that no watch reports must be read again."""
        return None if self.seen is None else self.seen.again_s


def _just_accepted(before: Object, stored: Object) -> bool:
    """Return whether the written status accepts its job, so that all its objects can be created at once.

    A job that was not accepted has never had a pod, so this needs no read to confirm it. With an
    `existingClaim`, a pod of an earlier job may still write to the claim, so that job needs the reads of the
    next reconcile.
    """
    accepted = part(stored, "status").get("release") and not part(before, "status").get("release")
    return bool(accepted) and part(stored, "spec", "storage").get("existingClaim") is None
