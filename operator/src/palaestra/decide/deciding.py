"""The decision: each replica by itself, then the job as a whole, then what is to be done."""

from collections.abc import Sequence
from datetime import datetime

from palaestra.api import TrainingJob
from palaestra.api.reasons import Reason, say
from palaestra.api.status import TERMINAL, Phase, Release, ReplicaStatus, Status
from palaestra.decide.acting import actions
from palaestra.decide.conditions import Claim, Told, claims, conditions
from palaestra.decide.counting import counted
from palaestra.decide.decision import Decision
from palaestra.decide.ending import expired, expires
from palaestra.decide.happenings import of_actions, of_change
from palaestra.decide.moments import after, next_of, whole
from palaestra.decide.preparing import Prepared
from palaestra.decide.remembering import late_word
from palaestra.decide.replicas import Decided, decided
from palaestra.decide.situation import Situation
from palaestra.decide.summary import active, columns, completed, standing, started
from palaestra.observe.views import Observed, ReplicaObserved

EPHEMERAL = "; the run is ephemeral and goes with its pod"


def decide(job: TrainingJob, observed: Observed, prepared: Prepared, now: datetime) -> Decision:
    """Return the status of a job and what is to be done about it.

    `now` has a time zone. Deciding again on the status that came out, with nothing else changed, gives the
    same status, no event of a change, and no action but those that have not shown an effect yet.
    """
    now = whole(now)
    each = tuple(_replica(job, seen, prepared, now) for seen in observed.replicas)
    if job.status.phase in TERMINAL:
        kept = {"observed_generation": job.metadata.generation, "replicas": _kept(job, each)}
        status = job.status.model_copy(update=kept)
    else:
        status = _status(job, observed, prepared, tuple(it.status for it in each), now)
    expiry = expires(status, job.spec.ttl_seconds_after_finished)
    todo = (
        *actions(job, observed, prepared, each),
        *expired(job.metadata.name, job.metadata.uid, expiry, status, now),
    )
    moments = [expiry, *(at for it in each for at in it.moments)]
    return Decision(
        status=status,
        actions=todo,
        events=(*of_change(job.status, status), *of_actions(todo)),
        wake_after_s=next_of(moments, now),
    )


def _replica(job: TrainingJob, seen: ReplicaObserved, prepared: Prepared, now: datetime) -> Decided:
    before = {each.index: each for each in job.status.replicas}
    old = before.get(seen.index, ReplicaStatus(index=seen.index))
    situation = Situation(
        job=job, old=old, seen=seen, counted=counted(old, seen), now=now, deadline=_deadline(job, now)
    )
    if old.phase in TERMINAL or job.status.phase in TERMINAL:
        late = old.model_copy(update={"last_attempt": late_word(situation)})
        return Decided(status=late, stop=_still_to_stop(old, seen))
    return decided(situation, prepared.hold)


def _kept(job: TrainingJob, each: Sequence[Decided]) -> tuple[ReplicaStatus, ...]:
    """Return the replicas of a job that has ended; one that it never had is not made up."""
    had = {it.index for it in job.status.replicas}
    return tuple(it.status for it in each if it.status.index in had)


def _still_to_stop(old: ReplicaStatus, seen: ReplicaObserved) -> Told | None:
    """Return why to stop a replica that failed while its Job goes on, as one that was made meanwhile."""
    going_on = seen.job is not None and seen.job.end is None and seen.job.stopped is None
    if not going_on or old.phase is not Phase.FAILED:
        return None
    return Told(reason=Reason(old.reason or Reason.JOB_FAILED), message=old.message or "")


def _deadline(job: TrainingJob, now: datetime) -> datetime | None:
    """Return when the active time of a job is over; None: it is suspended, or there is no bound."""
    bound, spent, since = job.spec.active_deadline_seconds, job.status.active_seconds, job.status.active_since
    if bound is None or (since is None and spent < bound):
        return None
    return after(since or now, bound - spent)


def _status(
    job: TrainingJob,
    observed: Observed,
    prepared: Prepared,
    replicas: Sequence[ReplicaStatus],
    now: datetime,
) -> Status:
    old = job.status
    where = standing(replicas)
    accepted = _accepted(job, prepared)
    seconds, since = active(old, where.phase, replicas, now)
    generation = job.metadata.generation
    return Status(
        observed_generation=generation,
        phase=where.phase,
        release=old.release or _release(prepared),
        conditions=conditions(old, claims(accepted, where.phase, where.told), generation, now),
        start_time=started(old, observed),
        completion_time=completed(where.phase, observed, now),
        active_seconds=seconds,
        active_since=since,
        replicas=tuple(replicas),
        **columns(job, replicas),
    )


def _accepted(job: TrainingJob, prepared: Prepared) -> Claim:
    """Return whether the job is accepted; once it was, it stays so."""
    if prepared.hold is not None and job.status.release is None:
        return Claim(holds=False, told=prepared.hold.told)
    note = EPHEMERAL if job.spec.storage.ephemeral else ""
    return Claim(holds=True, told=Told(reason=Reason.ACCEPTED, message=say(Reason.ACCEPTED, note=note)))


def _release(prepared: Prepared) -> Release | None:
    images = prepared.images if prepared.plan is not None else None
    if images is None:
        return None
    return Release(trainer=images.trainer, stub=images.stub, webots=images.webots)
