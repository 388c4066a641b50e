"""The conditions of a TrainingJob.

Five of them always exist, each with a reason, whether it holds or not. The subject of a job's reason is the
condition of its phase. For a Pending job, the subject is Accepted while that does not hold, then Running.

Two more exist only while they hold. Flux and `helm --wait` read them through the library kstatus: a job is
`Reconciling` while it is not yet as its spec asks, and `Stalled` if it needs a person to get there. A job
with neither is as its spec asks: it trains, has succeeded, or is suspended.
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
class Explanation:
    """A reason and its message."""

    reason: Reason
    message: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ConditionState:
    """Whether a condition holds, and why."""

    holds: bool
    explanation: Explanation


ConditionStates = Mapping[ConditionType, ConditionState]


def condition_states(accepted: ConditionState, phase: Phase, why: Explanation) -> ConditionStates:
    """Return the state of each condition of a job in `phase` for the reason `why`.

    All have the reason, but only its subject has the whole message; otherwise `kubectl describe` would print
    it four times.
    """
    true = _CONDITION_OF.get(phase)
    subject = true or (ConditionType.RUNNING if accepted.holds else ConditionType.ACCEPTED)
    elsewhere = Explanation(reason=why.reason, message=f"the job is {phase}; see the condition {subject}")
    others = {
        kind: ConditionState(holds=kind is true, explanation=why if kind is subject else elsewhere)
        for kind in _CONDITION_OF.values()
    }
    return {ConditionType.ACCEPTED: accepted, **others}


def reconciliation(phase: Phase, why: Explanation, *, suspend: bool) -> ConditionStates:
    """Return `Stalled` or `Reconciling` if a job is not as its spec asks, else neither.

    Each has the whole message, because kstatus shows nothing else. A job in a queue is `Reconciling` even if
    its spec asks for a suspension, because Kueue ignores that.

    Args:
        phase: of the job.
        why: the job's reason.
        suspend: whether the spec asks for a suspended job.
    """
    if phase is Phase.FAILED or why.reason in HELD:
        return {ConditionType.STALLED: ConditionState(holds=True, explanation=why)}
    wanted = Phase.SUSPENDED if suspend else Phase.RUNNING
    if phase is Phase.SUCCEEDED or (phase is wanted and why.reason is not Reason.QUEUED):
        return {}
    return {ConditionType.RECONCILING: ConditionState(holds=True, explanation=why)}


def conditions_of_ended(ended: Status) -> tuple[Condition, ...]:
    """Return the conditions of an ended job: those that it has, and `Stalled` if it failed.

    `Stalled` may be missing: the cluster's definition was not yet known to have this condition.
    """
    failed = condition(ended, ConditionType.FAILED)
    if ended.phase is not Phase.FAILED or failed is None or condition(ended, ConditionType.STALLED):
        return ended.conditions
    return (*ended.conditions, failed.model_copy(update={"type": ConditionType.STALLED}))


def conditions(
    old: Status, current: ConditionStates, generation: int | None, now: datetime
) -> tuple[Condition, ...]:
    """Return the conditions that are current; if a status has not changed, its time stays."""
    before = {condition.type: condition for condition in old.conditions}
    return tuple(
        _condition(kind, state, before.get(kind), generation, now) for kind, state in current.items()
    )


def condition(status: Status, kind: ConditionType) -> Condition | None:
    """Return the condition of a type; None if the status has none."""
    return next((condition for condition in status.conditions if condition.type is kind), None)


def _condition(
    kind: ConditionType, state: ConditionState, old: Condition | None, generation: int | None, now: datetime
) -> Condition:
    status = ConditionStatus.TRUE if state.holds else ConditionStatus.FALSE
    kept = old is not None and old.status is status
    return Condition(
        type=kind,
        status=status,
        reason=state.explanation.reason.value,
        message=state.explanation.message,
        last_transition_time=old.last_transition_time if old is not None and kept else now,
        observed_generation=generation,
    )
