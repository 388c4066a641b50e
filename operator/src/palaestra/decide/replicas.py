"""One replica: from what its status said and what is seen to its status now, and whether to stop it."""

from dataclasses import dataclass
from datetime import datetime

from palaestra.api.reasons import Reason
from palaestra.api.status import TERMINAL, Phase, ReplicaStatus
from palaestra.decide.attempts import paused
from palaestra.decide.conditions import Told
from palaestra.decide.deadlines import DEADLINES
from palaestra.decide.memory import memory_kills
from palaestra.decide.outcomes import ended, last_word_by
from palaestra.decide.preparing import Hold
from palaestra.decide.progress import progress
from palaestra.decide.remembering import last_attempt
from palaestra.decide.situation import Situation, Verdict, told
from palaestra.decide.troubles import TROUBLES, lost_at, objects_refused


@dataclass(frozen=True, slots=True, kw_only=True)
class Decided:
    """The status of a replica, why to stop it (None: go on), and when time alone may change it."""

    status: ReplicaStatus
    stop: Told | None = None
    moments: tuple[datetime, ...] = ()


def decided(it: Situation, hold: Hold | None) -> Decided:
    """Return what follows for a replica that had not ended; `hold` keeps its objects from being made."""
    end = ended(it)
    if end is not None:
        return Decided(status=_status(it, end))
    deadlines = [found for check in DEADLINES if (found := check(it)) is not None]
    over = next((each.told for each in deadlines if each.at <= it.now), None)
    if it.seen.job is None and hold is not None and hold.final:
        over = hold.told
    if over is not None and it.seen.job is None:  # there is nothing to stop, and nothing will be made
        return Decided(status=_status(it, Verdict(phase=Phase.FAILED, told=over)))
    waited_for = (at for at in (last_word_by(it), lost_at(it)) if at is not None)
    moments = (*waited_for, *(each.at for each in deadlines))
    return Decided(status=_status(it, _standing(it, hold)), stop=over, moments=moments)


def _standing(it: Situation, hold: Hold | None) -> Verdict:
    """Return where a replica stands that goes on."""
    job, spec = it.seen.job, it.job.spec
    if job is None and hold is not None:
        return Verdict(phase=Phase.PENDING, told=hold.told)
    if job is None and (denied := objects_refused(it)) is not None:
        return Verdict(phase=Phase.SUSPENDED if spec.suspend else Phase.PENDING, told=denied)
    if (job is None and spec.suspend) or (job is not None and job.suspended):
        return Verdict(phase=Phase.SUSPENDED, told=paused(it))
    trouble = next((found for check in TROUBLES if (found := check(it)) is not None), None)
    trainer = it.seen.pod.trainer if it.seen.pod is not None and job is not None else None
    if trainer is not None and trainer.exit is not None and not trouble:
        what = f"attempt {it.counted.attempt} has ended, its simulators are stopped"
        return Verdict(phase=Phase.RUNNING, told=told(Reason.TRAINING, what=what))
    lost = trouble is not None and trouble.reason is Reason.NODE_LOST  # as its node said last, it runs
    runs = it.pod is not None and trainer is not None and trainer.running_since is not None and not lost
    phase = Phase.RUNNING if runs else Phase.PENDING
    return Verdict(phase=phase, told=trouble or (_running(it) if runs else _starting(it)))


def _running(it: Situation) -> Told:
    if it.seen.polled is not None and not it.trains:
        return told(Reason.STARTING, what="its simulators are on their way")
    return told(Reason.TRAINING, what=f"attempt {it.counted.attempt} trains{_unheeded(it)}")


def _unheeded(it: Situation) -> str:
    """Return what to say of a suspension that is Kueue's to decide; a namespace may have a default queue."""
    job = it.seen.job
    if job is None or not job.queue or not it.job.spec.suspend:
        return ""
    return f"; spec.suspend is not heeded, as queue {job.queue} starts and stops it"


def _starting(it: Situation) -> Told:
    there = [*it.seen.in_the_way, *([it.pod.name] if it.pod is not None else [])]
    if it.seen.job is None:
        waits = f"waits for pod {there[0]} to end" if there else "is about to be created"
        return told(Reason.STARTING, what=waits)
    if it.seen.pod is None:
        return told(Reason.STARTING, what="its pod is about to be created")
    return told(
        Reason.STARTING, what="its last pod has ended" if it.seen.pod.ended else "its containers start"
    )


def _status(it: Situation, verdict: Verdict) -> ReplicaStatus:
    old, reason = it.old, verdict.told.reason.value
    changed = (old.phase, old.reason) != (verdict.phase, reason) or old.since is None
    counts = it.counted
    return old.model_copy(
        update={
            "phase": verdict.phase,
            "reason": reason,
            "message": verdict.told.message,
            "since": it.now if changed else old.since,
            "attempt": counts.attempt,
            "pod": counts.pod,
            "restarts": counts.restarts,
            "simulator_restarts": counts.simulator_restarts,
            "furthest_step": counts.furthest_step,
            "fruitless": counts.fruitless,
            "last_attempt": last_attempt(it, verdict if verdict.phase in TERMINAL else None),
            "memory_kills": memory_kills(it),
            **progress(it, verdict.phase),
        }
    )
