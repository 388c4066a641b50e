"""The ordered list of checks on a replica that has not ended.

`make golden` writes the list into docs/explain/judging.md. Each reconcile runs all checks, because a
check may also return the time after which it will hold. The class of a check that holds sets the consequence:

- ended: the replica has ended for the reason of the first one that holds; the others are ignored.
- final: the first one that holds stops the replica for good, by a mark on its Job.
- counted: the operator replaces the pod, or its Job does, at most `backoffLimit` times.
- waiting: the status shows its reason; nothing is ended or counted.
- shown: the status shows the state of the replica.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

from palaestra.api.reasons import LONGEST_MESSAGE, Reason
from palaestra.api.status import Phase
from palaestra.api.text import one_line
from palaestra.decide import (
    current_state,
    eviction,
    failure_checks,
    job_end,
    remaining_containers,
    waiting_reasons,
)
from palaestra.decide.clocks import Wait, WaitingReason
from palaestra.decide.conditions import Explanation
from palaestra.decide.replica_context import STARTING, Check, Finding, ReplicaContext, ReplicaVerdict, after

FIRST_STEP = ("first step",)  # the key of the wait for the first step
MOMENT_S = 60  # a kubelet that restarts or retries reports a reason again within this time


class CheckKind(StrEnum):
    """The class of a check, which sets the consequence if it holds."""

    ENDED = "ended"
    FINAL = "final"
    COUNTED = "counted"
    WAITING = "waiting"
    SHOWN = "shown"


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplicaActions:
    """The actions and waits that follow from the checks on a replica.

    Attributes:
        stop: the reason to stop it for good; None: it continues.
        replace: the reason to replace its pod; None: the pod stays.
        left_s: seconds after which the verdict may change by time alone.
        waits: the open waits, kept until the next reconcile.
        trouble: the cause that delays its first step, kept too; None if no cause is known, or if the first
            step was done.
    """

    stop: Explanation | None = None
    replace: Explanation | None = None
    left_s: tuple[float, ...] = ()
    waits: tuple[Wait, ...] = ()
    trouble: WaitingReason | None = None


def judge(situation: ReplicaContext) -> tuple[ReplicaVerdict, ReplicaActions]:
    """Return the verdict on a replica and its actions, by the first checks of the list that hold."""
    asked = [(kind, finding) for kind, check in JUDGED if (finding := check(situation)) is not None]
    left_s = tuple(finding.left_s for _, finding in asked if finding.left_s > 0)
    waits = tuple(finding.wait for _, finding in asked if finding.wait is not None)
    holding = [(kind, finding) for kind, finding in asked if finding.left_s <= 0]
    if (end := _first(holding, CheckKind.ENDED)) is not None:
        return _verdict(situation, end), ReplicaActions(waits=waits)
    stop = _first(holding, CheckKind.FINAL)
    if stop is not None and situation.seen.job is None:  # no Job exists, and none will be created
        return ReplicaVerdict(phase=Phase.FAILED, explanation=stop.explanation), ReplicaActions()
    kind, shown = next(
        (kind, each) for kind, each in holding if kind not in {CheckKind.ENDED, CheckKind.FINAL}
    )
    replaced = kind is CheckKind.COUNTED and stop is None
    course = ReplicaActions(
        stop=None if stop is None else stop.explanation,
        replace=shown.explanation if replaced else None,
        left_s=left_s,
        waits=waits,
        trouble=_trouble(situation, shown.explanation)
        if FIRST_STEP in {wait.key for wait in waits}
        else None,
    )
    return _verdict(situation, _refused(situation, shown) if replaced else shown), course


def start_timeout(situation: ReplicaContext) -> Finding | None:
    """It has not done its first step within `startTimeoutSeconds`; the reason is the cause of the delay."""
    if (
        situation.suspended
        or situation.hold is not None
        or situation.counted.furthest_step
        or _is_past_its_start(situation)
    ):
        return None
    seconds = situation.job.spec.start_timeout_s
    asked = (finding for kind, check in JUDGED if kind in SHOWN and (finding := check(situation)) is not None)
    shown = next(finding.explanation for finding in asked if finding.left_s <= 0)
    trouble = _trouble(situation, shown)
    reason = Reason.START_TIMEOUT if trouble is None else trouble.explanation.reason
    why = shown.message
    if trouble is not None and trouble.gone_s is not None:
        why = f"a moment ago: {trouble.explanation.message}"
    words = f"no step within {seconds} s, as long as startTimeoutSeconds allows; {why}"
    explanation = Explanation(reason=reason, message=one_line(words, LONGEST_MESSAGE))
    return after(situation, Wait(key=FIRST_STEP, seconds=seconds), explanation)


def _trouble(situation: ReplicaContext, shown: Explanation) -> WaitingReason | None:
    """Return the cause that delays the first step, even if the kubelet stops reporting it for a moment."""
    if shown.reason not in _NO_TROUBLE:
        return WaitingReason(explanation=shown)
    last, now_s = situation.times.record.troubles.get(situation.seen.index), situation.times.clock_s
    if last is None:
        return None
    gone_s = now_s if last.gone_s is None else last.gone_s
    return replace(last, gone_s=gone_s) if now_s - gone_s <= MOMENT_S else None


def _is_past_its_start(situation: ReplicaContext) -> bool:
    """Return whether the trainer runs and does not report that its simulators still start."""
    polled = situation.seen.polled
    return current_state.runs(situation) and (polled is None or polled.status.phase != STARTING)


def _first(holding: Sequence[tuple[CheckKind, Finding]], kind: CheckKind) -> Finding | None:
    return next((finding for each, finding in holding if each is kind), None)


def _refused(situation: ReplicaContext, shown: Finding) -> Finding:
    """Return the reason to replace a pod, with the API server's reason if it refuses the eviction."""
    if not situation.seen.denied:
        return shown
    words = one_line(
        f"{shown.explanation.message}; it is not replaced yet: {situation.seen.denied}", LONGEST_MESSAGE
    )
    return replace(shown, explanation=Explanation(reason=shown.explanation.reason, message=words))


def _verdict(situation: ReplicaContext, finding: Finding) -> ReplicaVerdict:
    phase = Phase.RUNNING if current_state.runs(situation) else Phase.PENDING
    return ReplicaVerdict(phase=finding.phase or phase, explanation=finding.explanation)


_NO_TROUBLE = frozenset({Reason.STARTING, Reason.TRAINING, Reason.DISRUPTED, Reason.INTERRUPTED})
SHOWN = frozenset(
    {CheckKind.COUNTED, CheckKind.WAITING, CheckKind.SHOWN}
)  # these classes set the reason of a replica that continues

JUDGED: tuple[tuple[CheckKind, Check], ...] = (
    (CheckKind.ENDED, job_end.ended_by_others),
    (CheckKind.ENDED, job_end.job_is_complete),
    (CheckKind.ENDED, job_end.stopped),
    (CheckKind.ENDED, job_end.trainer_was_done),
    (CheckKind.ENDED, job_end.would_end_the_same),
    (CheckKind.ENDED, job_end.backoff_limit_spent),
    (CheckKind.ENDED, job_end.job_failed),
    (CheckKind.FINAL, remaining_containers.trainer_is_done),
    (CheckKind.FINAL, failure_checks.active_deadline),
    (CheckKind.FINAL, failure_checks.cannot_be_planned),
    (CheckKind.FINAL, failure_checks.image_name_is_invalid),
    (CheckKind.FINAL, eviction.replaced_too_often),
    (CheckKind.FINAL, failure_checks.no_progress),
    (CheckKind.FINAL, start_timeout),
    (CheckKind.WAITING, current_state.held),
    (CheckKind.WAITING, waiting_reasons.objects_refused),
    (CheckKind.WAITING, waiting_reasons.node_lost),
    (CheckKind.SHOWN, current_state.suspending),
    (CheckKind.SHOWN, current_state.suspended),
    (CheckKind.WAITING, waiting_reasons.name_taken),
    (CheckKind.WAITING, waiting_reasons.old_pod_holds_claim),
    (CheckKind.WAITING, waiting_reasons.pods_refused),
    (CheckKind.COUNTED, eviction.marked),
    (CheckKind.COUNTED, eviction.restart_policy_dropped),
    (CheckKind.WAITING, waiting_reasons.unschedulable),
    (CheckKind.WAITING, waiting_reasons.volume_not_mounted),
    (CheckKind.WAITING, waiting_reasons.image_does_not_come),
    (CheckKind.WAITING, waiting_reasons.container_refused),
    (CheckKind.COUNTED, eviction.trainer_never_started),
    (CheckKind.COUNTED, eviction.stalled),
    (CheckKind.COUNTED, eviction.ended_by_probe),
    (CheckKind.COUNTED, remaining_containers.pod_outlives_trainer),
    (CheckKind.WAITING, remaining_containers.kept_alive),
    (CheckKind.WAITING, waiting_reasons.sidecar_out_of_memory),
    (CheckKind.WAITING, waiting_reasons.sidecar_crash_loops),
    (CheckKind.WAITING, waiting_reasons.simulator_not_up),
    (CheckKind.WAITING, waiting_reasons.pod_filled_its_storage),
    (CheckKind.WAITING, waiting_reasons.pod_was_taken),
    (CheckKind.WAITING, waiting_reasons.volume_is_full),
    (CheckKind.WAITING, waiting_reasons.pod_failed),
    (CheckKind.SHOWN, current_state.trainer_has_ended),
    (CheckKind.SHOWN, current_state.trains),
    (CheckKind.SHOWN, current_state.starts),
)
