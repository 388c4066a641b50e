"""The loop: compare what is with what should be, and bring it a step closer.

Level-triggered: it is told that something about a job changed, never what. Everything that it goes by
is read from the cluster, so that it can be killed between any two writes and started again. What is
wanted and what is to be said is decided in `palaestra.decide`, which is pure; nothing is built here.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Any

import structlog

from palaestra.api import TrainingJob
from palaestra.cluster import NamespaceTerminating
from palaestra.decide import (
    Decision,
    Prepared,
    Record,
    Refused,
    Times,
    accept,
    decide,
    managed_here,
    prepare,
    reject,
    wants_whole,
)
from palaestra.observe import lacking, trimmed
from palaestra.observe.reading import part
from palaestra.operator.acting import Acting
from palaestra.operator.caches import Caches
from palaestra.operator.looking import Looking, Seen, earliest
from palaestra.operator.poller import Key
from palaestra.operator.records import Records
from palaestra.operator.telling import StatusWrite, Telling
from palaestra.plan import ClusterLayout

log = structlog.get_logger(__name__)

Object = Mapping[str, Any]


def now(record: Record) -> Times:
    """Return the clocks as they are; `record` is what the last look left."""
    return Times(now=datetime.now(UTC), clock_s=time.monotonic(), record=record)


class Controller:
    """Reconciles TrainingJobs, each by one worker at a time.

    Args:
        caches: what is watched.
        looking: what there is of a job.
        acting: does what was decided.
        telling: writes status and events.
        layout: of this release in this cluster.
        times: the clocks at a look, by what the last one left.
    """

    def __init__(
        self,
        caches: Caches,
        looking: Looking,
        acting: Acting,
        telling: Telling,
        layout: ClusterLayout,
        times: Callable[[Record], Times] = now,
    ) -> None:
        self._caches = caches
        self._looking = looking
        self._acting = acting
        self._telling = telling
        self._layout = layout
        self._times = times
        self._records = Records()
        self._terminating: set[Key] = set()  # of which it was logged

    def begin_anew(self) -> None:
        """Forget since when anything is waited for: another operator may have led meanwhile."""
        self._records.clear()

    def reconcile(self, key: Key) -> float | None:
        """Look at one TrainingJob and do what is to be done; return seconds until time may change that.

        Raises:
            ApiError: it is to be tried again later; what was done stays done. In a namespace that is being
                deleted nothing is tried again: each change in it is a look anyway.
            Outdated: the cache is behind.
            NotLeading: another operator may lead.
        """
        raw = self._caches.training_job(key)
        if raw is None or not managed_here(raw):
            self._looking.forget(key)
            self._telling.forget(key)
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
        """Look, decide and act; once more if that has just accepted the job."""
        times = self._times(self._records.of(key, raw["metadata"]["uid"]))
        look = self._look(raw, times)
        written = self._carry_out(raw, look, times)
        if written.stored is not None and _just_accepted(raw, written.stored):
            look = self._decide_anew(written.stored, look, times)
            written = self._carry_out(trimmed(written.stored), look, times)
        return earliest(look.decision.wake_after_s, look.again_s, written.again_s)

    def _look(self, raw: Object, times: Times) -> "_Look":
        """Return what there is of a job, and what follows."""
        try:
            job, seen = self._observe(raw)
        except Refused as refused:
            return _Look(decision=reject(raw, refused, times.now))
        prepared = prepare(job, seen.observed, self._layout)
        decision = decide(job, seen.observed, prepared, times)
        return _Look(decision=decision, seen=seen, prepared=prepared)

    def _decide_anew(self, stored: Object, look: "_Look", times: Times) -> "_Look":
        """Return what follows now that the status accepts the job; there is nothing of it yet to look at."""
        if look.seen is None or look.prepared is None:
            raise AssertionError("unreachable: a refused job is not accepted")
        decision = decide(accept(stored), look.seen.observed, look.prepared, times)
        return replace(look, decision=decision, just_accepted=True)

    def _carry_out(self, raw: Object, look: "_Look", times: Times) -> StatusWrite:
        """Do what was decided, then write it."""
        key, decision = (raw["metadata"]["namespace"], raw["metadata"]["name"]), look.decision
        self._records.keep(key, raw["metadata"]["uid"], decision.record)
        denied = self._acting.carry_out(raw, decision.actions, confirmed=look.just_accepted)
        written = self._telling.tell(raw, decision, denied, times.clock_s)
        if denied:
            raise next(iter(denied.values()))
        return written

    def _observe(self, raw: Object) -> tuple[TrainingJob, Seen]:
        """Return a job with what there is of it, read whole if it is to be planned.

        Raises:
            Refused: it cannot be looked after as it stands.
        """
        job = accept(raw)
        seen = self._looking.look(job)
        if not wants_whole(job, seen.observed, self._layout, lacking(raw)):
            return job, seen
        job = accept(self._looking.whole(raw))
        return job, self._looking.ask_for(job, seen)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Look:
    """What there is of a job and what follows; of a refused one there is only the latter.

    `just_accepted`: this look has written the status that accepts the job.
    """

    decision: Decision
    seen: Seen | None = None
    prepared: Prepared | None = None
    just_accepted: bool = False

    @property
    def again_s(self) -> float | None:
        """Seconds until something has to be asked for anew."""
        return None if self.seen is None else self.seen.again_s


def _just_accepted(before: Object, stored: Object) -> bool:
    """Return whether a status that was written accepts its job, so that all of it can be created at once.

    A job that was not accepted has never had a pod, so no read has to confirm it. On a claim of somebody else
    a pod of an earlier job may still write: that needs the reads of the next look.
    """
    accepted = part(stored, "status").get("release") and not part(before, "status").get("release")
    return bool(accepted) and part(stored, "spec", "storage").get("existingClaim") is None
