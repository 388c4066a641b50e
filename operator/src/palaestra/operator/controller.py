"""The loop: compare what is with what should be, and bring it a step closer.

Level-triggered: it is told that something about a job changed, never what. Everything that it goes by
is read from the cluster, so that it can be killed between any two writes and started again. What is
wanted and what is to be said is decided in `palaestra.decide`, which is pure; nothing is built here.
"""

import time
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from typing import Any

from palaestra.api import TrainingJob
from palaestra.decide import (
    Decision,
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
from palaestra.observe import lacking
from palaestra.operator.acting import Acting
from palaestra.operator.caches import Caches
from palaestra.operator.looking import Looking, Seen, earliest
from palaestra.operator.poller import Key
from palaestra.operator.records import Records
from palaestra.operator.telling import Telling
from palaestra.plan import ClusterLayout

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

    def begin_anew(self) -> None:
        """Forget since when anything is waited for: another operator may have led meanwhile."""
        self._records.clear()

    def reconcile(self, key: Key) -> float | None:
        """Look at one TrainingJob and do what is to be done; return seconds until time may change that.

        Raises:
            ApiError: it is to be tried again later; what was done stays done.
            Outdated: the cache is behind.
            NotLeading: another operator may lead.
        """
        raw = self._caches.training_job(key)
        if raw is None or not managed_here(raw):
            self._looking.forget(key)
            self._telling.forget(key)
            self._records.forget(key)
            return None
        uid = raw["metadata"]["uid"]
        times = self._times(self._records.of(key, uid))
        decision, again_s = self._decide(raw, times)
        self._records.keep(key, uid, decision.record)
        denied = self._acting.carry_out(raw, decision.actions)
        held_back_s = self._telling.tell(raw, decision, denied, times.clock_s)
        if denied:
            raise next(iter(denied.values()))
        return earliest(decision.wake_after_s, again_s, held_back_s)

    def _decide(self, raw: Object, times: Times) -> tuple[Decision, float | None]:
        """Return what follows from what there is, and seconds until it has to be asked for anew."""
        try:
            job, seen = self._look(raw)
        except Refused as refused:
            return reject(raw, refused, times.now), None
        prepared = prepare(job, seen.observed, self._layout)
        return decide(job, seen.observed, prepared, times), seen.again_s

    def _look(self, raw: Object) -> tuple[TrainingJob, Seen]:
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
