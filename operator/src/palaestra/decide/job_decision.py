"""The decision: first the status of each replica, then the status of the job, then the actions."""

from collections.abc import Sequence
from dataclasses import replace

from palaestra.api import TrainingJob
from palaestra.api.reasons import Reason
from palaestra.api.status import TERMINAL, Phase, Release, ReplicaStatus, Status
from palaestra.decide.actions import actions, expired, expires
from palaestra.decide.clocks import ReconcileRecord, Times, first_of, seconds_to, whole
from palaestra.decide.decision import Decision
from palaestra.decide.events import edits, of_actions, of_change
from palaestra.decide.explanation import Explanation, explain
from palaestra.decide.job_status import (
    ConditionState,
    ConditionStates,
    active,
    as_first,
    columns,
    condition_states,
    conditions,
    conditions_of_ended,
    left_out,
    reconciliation,
    standing,
    started,
)
from palaestra.decide.last_attempt import late_word
from palaestra.decide.lost_runs import new_word, restarted
from palaestra.decide.preconditions import Prepared
from palaestra.decide.replica_context import ReplicaContext, ReplicaVerdict
from palaestra.decide.replica_policy import Decided, ReplicaActions, decided
from palaestra.decide.restart_counts import counted
from palaestra.observe.json_access import MOST_COUNT
from palaestra.observe.models import Observed, ReplicaObserved

EPHEMERAL = "; the run is ephemeral and is deleted with its pod"


def decide(job: TrainingJob, observed: Observed, prepared: Prepared, times: Times) -> Decision:
    """Return the status of a job and the actions for it.

    A second decision on the resulting status and record, with the same observation, returns the same status
    and no event about a change. The second decision returns only the actions whose effect is not in the
    observation yet.
    """
    now = whole(times.now)
    times = replace(times, now=now)
    decided = tuple(_replica(job, seen, prepared, times) for seen in observed.replicas)
    if job.status.phase in TERMINAL:
        updates = {
            "observed_generation": job.metadata.generation,
            "conditions": conditions_of_ended(job.status),
            "replicas": _kept(job, decided),
        }
        status = job.status.model_copy(update=updates)
    else:
        status = _status(job, observed, prepared, tuple(replica.status for replica in decided), times)
    expiry = expires(status, job.spec.ttl_seconds_after_finished)
    todo = (
        *actions(job, observed, prepared, decided),
        *expired(job.metadata.name, job.metadata.uid, expiry, status, now),
    )
    waits_s = (seconds_to(expiry, now), *(left_s for replica in decided for left_s in replica.course.left_s))
    return Decision(
        status=status,
        actions=todo,
        events=(*of_change(job.status, status), *of_actions(todo, status.replicas), *edits(job, observed)),
        wake_after_s=first_of(waits_s),
        record=_record(job, decided, status, times),
    )


def _record(job: TrainingJob, decided: Sequence[Decided], status: Status, times: Times) -> ReconcileRecord:
    """Return the record for the next reconcile: open waits, waiting reasons, and the active time."""
    return ReconcileRecord(
        waits={
            (replica.status.index, *wait.key): times.since_s(replica.status.index, wait)
            for replica in decided
            for wait in replica.course.waits
        },
        troubles={
            replica.status.index: replica.course.trouble
            for replica in decided
            if replica.course.trouble is not None
        },
        active_s=times.active_s(job.status.active_seconds),
        active_at_s=times.clock_s if status.active_since is not None else None,
    )


def _replica(job: TrainingJob, seen: ReplicaObserved, prepared: Prepared, times: Times) -> Decided:
    before = {replica.index: replica for replica in job.status.replicas}
    old = before.get(seen.index, ReplicaStatus(index=seen.index))
    situation = ReplicaContext(
        job=job,
        old=old,
        seen=seen,
        counted=counted(old, seen),
        times=times,
        active_left_s=_active_left_s(job, times),
        hold=prepared.hold_of(job, seen),
    )
    if old.phase in TERMINAL or job.status.phase in TERMINAL:
        late = old.model_copy(update={"last_attempt": late_word(situation)})
        return Decided(status=late, course=ReplicaActions(stop=_still_to_stop(old, seen)))
    return _with_lost_run(decided(situation), job, prepared, times)


def _with_lost_run(found: Decided, job: TrainingJob, prepared: Prepared, times: Times) -> Decided:
    """Return a replica with its lost run.

    A new value of the annotation `palaestra.dev/restart-lost-runs` marks the run in the status as restarted.
    """
    shown, lost = found.status.lost, prepared.lost.get(found.status.index)
    if found.status.phase in TERMINAL:
        return found
    if lost is None:
        gone = shown is not None and shown.restarted is None  # a person has restored the claim
        return replace(found, status=found.status.model_copy(update={"lost": None})) if gone else found
    if shown == lost and new_word(job) is not None:
        return replace(found, status=restarted(found.status, lost, times.now))
    return replace(found, status=found.status.model_copy(update={"lost": lost}))


def _kept(job: TrainingJob, decided: Sequence[Decided]) -> tuple[ReplicaStatus, ...]:
    """Return those replicas of an ended job that are in its stored status."""
    had = {replica.index for replica in job.status.replicas}
    return tuple(replica.status for replica in decided if replica.status.index in had)


def _still_to_stop(old: ReplicaStatus, seen: ReplicaObserved) -> Explanation | None:
    """Return the reason to stop a failed replica whose Job still runs, for example a new Job."""
    going_on = seen.job is not None and seen.job.end is None and seen.job.stopped is None
    if not going_on or old.phase is not Phase.FAILED:
        return None
    return Explanation(reason=Reason(old.reason or Reason.JOB_FAILED), message=old.message or "")


def _active_left_s(job: TrainingJob, times: Times) -> float | None:
    """Return the remaining active seconds of a job; None if it is suspended or has no deadline."""
    bound, spent_s = job.spec.active_deadline_seconds, times.active_s(job.status.active_seconds)
    if bound is None or (job.status.active_since is None and spent_s < bound):
        return None
    return bound - spent_s


def _status(
    job: TrainingJob,
    observed: Observed,
    prepared: Prepared,
    replicas: Sequence[ReplicaStatus],
    times: Times,
) -> Status:
    old = job.status
    where = standing(replicas)
    current = {
        **condition_states(_accepted(job, prepared), where.phase, where.explanation),
        **_reconciliation(job, where, replicas),
    }
    now, generation = times.now, job.metadata.generation
    return Status(
        observed_generation=generation,
        phase=where.phase,
        release=old.release or _release(prepared),
        conditions=conditions(old, current, generation, now),
        start_time=started(old, observed),
        completion_time=now if where.phase in TERMINAL else None,
        active_seconds=min(int(times.active_s(old.active_seconds)), MOST_COUNT),
        active_since=now if active(where.phase, replicas) and not _waits(observed, prepared) else None,
        lost_runs_restarted=new_word(job) or old.lost_runs_restarted,
        left_out=left_out(old, observed),
        replicas=tuple(replicas),
        **columns(job, replicas),
    )


def _reconciliation(
    job: TrainingJob, where: ReplicaVerdict, replicas: Sequence[ReplicaStatus]
) -> ConditionStates:
    """Return the states of `Stalled` and `Reconciling`.

    If a suspended job still runs, the first running replica gives the reason.
    """
    unheeded = where.phase is Phase.RUNNING and job.spec.suspend
    why = as_first(replicas, Phase.RUNNING).explanation if unheeded else where.explanation
    return reconciliation(where.phase, why, suspend=job.spec.suspend)


def _waits(observed: Observed, prepared: Prepared) -> bool:
    """Return whether a hold keeps all replicas from being planned; then the job counts as inactive."""
    return prepared.hold is not None and all(replica.job is None for replica in observed.replicas)


def _accepted(job: TrainingJob, prepared: Prepared) -> ConditionState:
    """Return whether the job is accepted; an accepted job stays accepted."""
    if prepared.hold is not None and job.status.release is None:
        return ConditionState(holds=False, explanation=prepared.hold.explanation)
    note = EPHEMERAL if job.spec.storage.ephemeral else ""
    return ConditionState(holds=True, explanation=explain(Reason.ACCEPTED, note=note))


def _release(prepared: Prepared) -> Release | None:
    images = prepared.images if prepared.plan is not None else None
    if images is None:
        return None
    return Release(trainer=images.trainer, stub=images.stub, mujoco=images.mujoco, webots=images.webots)
