"""The conditions of a TrainingJob.

Five of them always exist, each with a reason, whether it holds or not. The condition of the job's phase
carries the job's message. A Pending job has no such condition; there the message is in Accepted until it
holds, then in Running.

Two more exist only while they hold. Flux and `helm --wait` read them through the library kstatus. A job is
`Reconciling` while its state differs from its spec, and `Stalled` if only a person can change that. The state
of a job with neither matches its spec: it trains, has succeeded, or is suspended.
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

    All have the reason, but only one has the whole message; otherwise `kubectl describe` would print it four
    times.
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
    """Return `Stalled` or `Reconciling` if the state of a job differs from its spec, else neither.

    Both have the whole message, because kstatus shows nothing else. A job in a queue is `Reconciling` even if
    `spec.suspend` is true, because Kueue ignores `spec.suspend`.

    Args:
        phase: the job's phase.
        why: the job's reason.
        suspend: the job's `spec.suspend`.
    """
    if phase is Phase.FAILED or why.reason in HELD:
        return {ConditionType.STALLED: ConditionState(holds=True, explanation=why)}
    wanted = Phase.SUSPENDED if suspend else Phase.RUNNING
    if phase is Phase.SUCCEEDED or (phase is wanted and why.reason is not Reason.QUEUED):
        return {}
    return {ConditionType.RECONCILING: ConditionState(holds=True, explanation=why)}


def conditions_of_ended(ended: Status) -> tuple[Condition, ...]:
    """Return the conditions of an ended job: its existing ones, and `Stalled` if it failed.

    `Stalled` may be missing: the cluster's definition was not yet known to have this condition.
    """
    failed = condition(ended, ConditionType.FAILED)
    if ended.phase is not Phase.FAILED or failed is None or condition(ended, ConditionType.STALLED):
        return ended.conditions
    return (*ended.conditions, failed.model_copy(update={"type": ConditionType.STALLED}))


def conditions(
    old: Status, current: ConditionStates, generation: int | None, now: datetime
) -> tuple[Condition, ...]:
    """Return the current conditions; a condition whose status has not changed keeps its transition time."""
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
