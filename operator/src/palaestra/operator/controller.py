"""The loop: compare what is with what should be, and bring it a step closer.

Level-triggered: it is told that something about a job changed, never what. Everything that it goes by
is read from the cluster, so that it can be killed between any two writes and started again. What is
wanted and what is to be said is decided in `palaestra.decide`, which is pure; nothing is built here.
"""

from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from typing import Any

from palaestra.decide import Decision, Refused, accept, decide, managed_here, prepare, reject
from palaestra.observe import observe
from palaestra.operator.acting import Acting
from palaestra.operator.caches import Caches
from palaestra.operator.looking import Looking, earliest
from palaestra.operator.poller import Key
from palaestra.operator.telling import Telling
from palaestra.plan import ClusterLayout

Object = Mapping[str, Any]


def utc_now() -> datetime:
    """Return the time in whole seconds, as a status has it."""
    return datetime.now(UTC).replace(microsecond=0)


class Controller:
    """Reconciles TrainingJobs, each by one worker at a time.

    Args:
        caches: what is watched.
        looking: what there is of a job.
        acting: does what was decided.
        telling: writes status and events.
        layout: of this release in this cluster.
        now: the clock.
    """

    def __init__(
        self,
        caches: Caches,
        looking: Looking,
        acting: Acting,
        telling: Telling,
        layout: ClusterLayout,
        now: Callable[[], datetime] = utc_now,
    ) -> None:
        self._caches = caches
        self._looking = looking
        self._acting = acting
        self._telling = telling
        self._layout = layout
        self._now = now

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
            return None
        now = self._now()
        decision, again_s = self._decide(raw, now)
        denied = self._acting.carry_out(raw, decision.actions)
        held_back_s = self._telling.tell(raw, decision, denied, now)
        if denied:
            raise next(iter(denied.values()))
        return earliest(decision.wake_after_s, again_s, held_back_s)

    def _decide(self, raw: Object, now: datetime) -> tuple[Decision, float | None]:
        """Return what follows from what there is, and seconds until it has to be asked for anew."""
        try:
            job = accept(raw)
        except Refused as refused:
            return reject(raw, refused, now), None
        seen = self._looking.look(job)
        observed = observe(job, seen.objects)
        prepared = prepare(job, observed, self._layout)
        return decide(job, observed, prepared, now), seen.again_s
