"""The conditions of a TrainingJob.

Five are always there, each with a reason whether it holds or not. The subject of a job's reason is the
condition of its phase; of a job that is Pending, it is Accepted while that does not hold, then Running.

Two more are there only while they hold; kstatus reads them, the library by which Flux and `helm --wait` wait.
A job is `Reconciling` while it approaches its spec, and `Stalled` when it needs a person to get there. A job
with neither matches its spec: it trains, has succeeded, or is suspended.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime

from palaestra.api.reasons import HELD, Reason
from palaestra.api.status import Condition, ConditionStatus, ConditionType, Phase, Status

_CONDITION_OF = {
    Phase.RUNNING: ConditionType.RUNNING,
    Phase.SUSPENDED: ConditionType.SUSPENDED,
    Phase.SUCCEEDED: ConditionType.SUCCEEDED,
    Phase.FAILED: ConditionType.FAILED,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Told:
    """A reason and its message."""

    reason: Reason
    message: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """Whether a condition holds, and why."""

    holds: bool
    told: Told


Claims = Mapping[ConditionType, Claim]


def claims(accepted: Claim, phase: Phase, why: Told) -> Claims:
    """Return the claim of each condition of a job that stands in `phase` for the reason `why`.

    All have the reason; only its subject has the whole message, or `kubectl describe` would print it
    four times.
    """
    true = _CONDITION_OF.get(phase)
    subject = true or (ConditionType.RUNNING if accepted.holds else ConditionType.ACCEPTED)
    elsewhere = Told(reason=why.reason, message=f"the job is {phase}; see the condition {subject}")
    others = {
        kind: Claim(holds=kind is true, told=why if kind is subject else elsewhere)
        for kind in _CONDITION_OF.values()
    }
    return {ConditionType.ACCEPTED: accepted, **others}


def reconciliation(phase: Phase, why: Told, *, suspend: bool) -> Claims:
    """Return `Stalled` or `Reconciling` of a job that is not as its spec asks, nothing of one that is.

    Each has the whole message: it is all that kstatus passes on. A job in a queue waits for its turn,
    whatever its spec says of a suspension: a queue does not heed that.

    Args:
        phase: of the job.
        why: the job's reason.
        suspend: whether the spec asks for a suspended job.
    """
    if phase is Phase.FAILED or why.reason in HELD:
        return {ConditionType.STALLED: Claim(holds=True, told=why)}
    wanted = Phase.SUSPENDED if suspend else Phase.RUNNING
    if phase is Phase.SUCCEEDED or (phase is wanted and why.reason is not Reason.QUEUED):
        return {}
    return {ConditionType.RECONCILING: Claim(holds=True, told=why)}


def conditions_of_ended(ended: Status) -> tuple[Condition, ...]:
    """Return the conditions of a job that has ended: those that it has, with `Stalled` if it failed.

    One that failed under an earlier release has no `Stalled`, nor has one whose end was written before the
    definition in the cluster was known to take it.
    """
    failed = condition(ended, ConditionType.FAILED)
    if ended.phase is not Phase.FAILED or failed is None or condition(ended, ConditionType.STALLED):
        return ended.conditions
    return (*ended.conditions, failed.model_copy(update={"type": ConditionType.STALLED}))


def conditions(old: Status, current: Claims, generation: int | None, now: datetime) -> tuple[Condition, ...]:
    """Return the conditions of the current claims; one whose status has not changed keeps its time."""
    before = {each.type: each for each in old.conditions}
    return tuple(
        _condition(kind, claim, before.get(kind), generation, now) for kind, claim in current.items()
    )


def condition(status: Status, kind: ConditionType) -> Condition | None:
    """Return the condition of a type, None where the status has none."""
    return next((each for each in status.conditions if each.type is kind), None)


def _condition(
    kind: ConditionType, claim: Claim, old: Condition | None, generation: int | None, now: datetime
) -> Condition:
    status = ConditionStatus.TRUE if claim.holds else ConditionStatus.FALSE
    kept = old is not None and old.status is status
    return Condition(
        type=kind,
        status=status,
        reason=claim.told.reason.value,
        message=claim.told.message,
        last_transition_time=old.last_transition_time if old is not None and kept else now,
        observed_generation=generation,
    )
