"""The status of the whole job: its phase, its reason, its conditions, and the columns of `kubectl get`.

Five conditions always exist, each with a reason, whether true or false. The job's message is in the condition
of the job's phase. No condition exists for the phase Pending. In this phase, the message is in Accepted while
Accepted is false, and in Running afterwards.

Two more conditions exist only while they are true. Flux and `helm --wait` read these two conditions through
the library kstatus. A job is `Reconciling` while its state differs from its spec, and `Stalled` if only a
person can make state and spec equal. If a job has neither condition, its state matches its spec: the job
trains, has succeeded, or is suspended.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from palaestra.api import TrainingJob
from palaestra.api.reason_texts import say
from palaestra.api.reasons import HELD, Reason
from palaestra.api.status import (
    TERMINAL,
    Condition,
    ConditionStatus,
    ConditionType,
    Phase,
    ReplicaStatus,
    Status,
)
from palaestra.api.text import one_line
from palaestra.decide.explanation import Explanation
from palaestra.decide.replica_context import ReplicaVerdict
from palaestra.observe.models import Observed

LONGEST_NODES = 256  # maximum number of characters of all node names together
# Characters of one line: the name of a group, and at most 200 characters from a simulator.
LONGEST_LEFT_OUT = 230
_CONDITION_OF = {
    Phase.RUNNING: ConditionType.RUNNING,
    Phase.SUSPENDED: ConditionType.SUSPENDED,
    Phase.SUCCEEDED: ConditionType.SUCCEEDED,
    Phase.FAILED: ConditionType.FAILED,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class ConditionState:
    """Whether a condition holds, and the reason."""

    holds: bool
    explanation: Explanation


ConditionStates = Mapping[ConditionType, ConditionState]


def standing(replicas: Sequence[ReplicaStatus]) -> ReplicaVerdict:
    """Return the phase of the job with its reason."""
    phases = Counter(replica.phase for replica in replicas)
    if all(replica.phase in TERMINAL for replica in replicas):
        return _ended(replicas)
    if phases[Phase.RUNNING]:
        what = f"{phases[Phase.RUNNING]} of {len(replicas)} replicas train"
        return ReplicaVerdict(
            phase=Phase.RUNNING, explanation=Explanation(reason=Reason.TRAINING, message=what)
        )
    if phases[Phase.SUSPENDED] and not phases[Phase.PENDING]:
        return as_first(replicas, Phase.SUSPENDED)
    return as_first(replicas, Phase.PENDING)


def active(phase: Phase, replicas: Sequence[ReplicaStatus]) -> bool:
    """Return whether a job is active: it has not ended, and not all of its replicas are suspended."""
    suspended = all(replica.phase in TERMINAL | {Phase.SUSPENDED} for replica in replicas)
    return phase not in TERMINAL and not suspended


def started(old: Status, observed: Observed) -> datetime | None:
    """Return the start time of the job's first pod, by its node's clock."""
    if old.start_time is not None:
        return old.start_time
    begun = [pod for replica in observed.replicas for pod in replica.pods if pod.started is not None]
    first = min(begun, key=lambda pod: pod.created, default=None)
    return None if first is None else first.started


def columns(job: TrainingJob, replicas: Sequence[ReplicaStatus]) -> dict[str, Any]:
    """Return the columns of `kubectl get tj`; each figure is the worst value among the replicas."""
    up = sum(replica.phase in {Phase.RUNNING, Phase.SUCCEEDED} for replica in replicas)
    steps = [replica.step for replica in replicas if replica.step is not None]
    saved = [replica.last_checkpoint.time for replica in replicas if replica.last_checkpoint is not None]
    nodes = [replica.node for replica in replicas if replica.node is not None]
    rates = [replica.success_rate for replica in replicas if replica.success_rate is not None]
    return {
        "running": f"{up}/{job.spec.replicas}",
        "step": min(steps, default=None),
        "success_rate": min(rates, default=None),
        "attempt": max((replica.attempt for replica in replicas), default=0) or None,
        "restarts": max((replica.restarts.trainer for replica in replicas), default=0) or None,
        "last_checkpoint_time": min(saved, default=None),
        "nodes": one_line(",".join(dict.fromkeys(nodes)), LONGEST_NODES) or None,
    }


def left_out(old: Status, observed: Observed) -> tuple[str, ...] | None:
    """Return those parts of the worlds that the simulators last reported as left out; None without a report.

    All replicas have the same worlds and simulators, so one report is enough.
    """
    for replica in observed.replicas:
        if replica.polled is not None and replica.polled.status.left_out:
            lines = [one_line(line, LONGEST_LEFT_OUT) for line in replica.polled.status.left_out]
            return tuple(filter(None, lines)) or None
    return old.left_out


def _ended(replicas: Sequence[ReplicaStatus]) -> ReplicaVerdict:
    failed = [replica for replica in replicas if replica.phase is Phase.FAILED]
    if not failed:
        what = f"{len(replicas)} of {len(replicas)} replicas succeeded"
        return ReplicaVerdict(
            phase=Phase.SUCCEEDED, explanation=Explanation(reason=Reason.SUCCEEDED, message=what)
        )
    first = failed[0]
    explanation = Explanation(reason=Reason(first.reason or Reason.JOB_FAILED), message=first.message or "")
    if len(replicas) > 1:
        message = say(
            Reason.SOME_REPLICAS_FAILED,
            failed=len(failed),
            all=len(replicas),
            index=first.index,
            message=f"{first.reason}: {first.message}",
        )
        alike = len(failed) == len(replicas) and len({replica.reason for replica in failed}) == 1
        explanation = Explanation(
            reason=explanation.reason if alike else Reason.SOME_REPLICAS_FAILED, message=message
        )
    return ReplicaVerdict(phase=Phase.FAILED, explanation=explanation)


def as_first(replicas: Sequence[ReplicaStatus], phase: Phase) -> ReplicaVerdict:
    """Return `phase` with the reason of the first replica in this phase."""
    first = next(replica for replica in replicas if replica.phase is phase)
    of = f"replica {first.index}: " if len(replicas) > 1 else ""
    explanation = Explanation(
        reason=Reason(first.reason or Reason.STARTING), message=f"{of}{first.message or ''}"
    )
    return ReplicaVerdict(phase=phase, explanation=explanation)


def condition_states(accepted: ConditionState, phase: Phase, why: Explanation) -> ConditionStates:
    """Return the state of each condition of a job in `phase` for the reason `why`.

    All conditions of the phase have the reason, but only one has the whole message. Otherwise `kubectl
    describe` would print the message four times.
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
    """Return `Stalled` or `Reconciling` if the state of a job differs from its spec, else {}.

    Each has the whole message, because kstatus shows only this message. A job in a queue is `Reconciling`
    even if `spec.suspend` is true, because Kueue ignores `spec.suspend`.

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
    """Return the conditions of an ended job: the existing ones, and `Stalled` if the job failed.

    `Stalled` may be missing: the operator may have written the status before it read that the cluster's CRD
    allows this condition.
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
    """Return the condition of a type; None if the status does not have it."""
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
