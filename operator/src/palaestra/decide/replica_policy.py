"""The decision on a replica: three ordered lists of checks, and the status and actions that follow from them.

`make golden` writes the lists into docs/explain/judging.md. In each list, the first check that holds now
decides. Each reconcile nevertheless runs all checks of a list. A check that does not hold yet may return the
seconds until it holds, and the operator reconciles again after this time.

- `ENDS`: the replica has ended for this reason; the other lists are ignored.
- `STOPS`: the operator stops the replica for good, by a mark on its Job. These checks use the results of
  `REASONS`.
- `REASONS`: the reason in the status of a replica that continues. The kind of the check determines whether
  the operator replaces the pod.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

from palaestra.api.reasons import LONGEST_MESSAGE
from palaestra.api.status import TERMINAL, Phase, ReplicaStatus
from palaestra.api.text import one_line
from palaestra.decide import current_state, eviction, failure_checks, job_end, waiting_reasons
from palaestra.decide.clocks import Wait, WaitingReason
from palaestra.decide.explanation import Explanation
from palaestra.decide.last_attempt import last_attempt
from palaestra.decide.pod_end import memory_kills
from palaestra.decide.progress import progress
from palaestra.decide.replica_context import Check, Finding, ReplicaContext, ReplicaVerdict

LONGEST_NODE = 253  # characters of a node's name; the API server has the same limit


class CheckKind(StrEnum):
    """The kind of a check in `REASONS`: the consequence if this check is the first that holds."""

    COUNTED = "counted"
    """The operator or the Job replaces the pod, at most `backoffLimit` times."""

    WAITING = "waiting"
    """The status shows the reason for which the replica waits; no pod is ended or counted."""

    SHOWN = "shown"
    """The status shows the state of the replica."""


ENDS: tuple[Check, ...] = (
    job_end.ended_by_others,
    job_end.job_is_complete,
    job_end.stopped,
    job_end.trainer_was_done,
    job_end.would_end_the_same,
    job_end.backoff_limit_spent,
    job_end.job_failed,
)
STOPS: tuple[Check, ...] = (
    eviction.trainer_is_done,
    failure_checks.active_deadline,
    failure_checks.cannot_be_planned,
    failure_checks.image_name_is_invalid,
    eviction.replaced_too_often,
    failure_checks.no_progress,
    failure_checks.start_timeout,
)
REASONS: tuple[tuple[CheckKind, Check], ...] = (
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
    (CheckKind.COUNTED, eviction.pod_outlives_trainer),
    (CheckKind.WAITING, eviction.kept_alive),
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


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplicaActions:
    """The actions and waits that follow from the checks on a replica.

    Attributes:
        stop: the reason to stop the replica for good; None: the replica continues.
        replace: the reason to replace the replica's pod; None: the pod stays.
        left_s: the times in seconds after which the decision may change by time alone.
        waits: the open waits, which the next reconcile continues.
        trouble: the cause that delays the first step, passed to the next reconcile; None if no cause is
            known, or if the first step was done.
    """

    stop: Explanation | None = None
    replace: Explanation | None = None
    left_s: tuple[float, ...] = ()
    waits: tuple[Wait, ...] = ()
    trouble: WaitingReason | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Decided:
    """The status of a replica, and the actions for it."""

    status: ReplicaStatus
    course: ReplicaActions = field(default_factory=ReplicaActions)


def decided(situation: ReplicaContext) -> Decided:
    """Return the status and actions of a replica that has not ended in its stored status."""
    verdict, course = judge(situation)
    return Decided(status=_status(situation, verdict), course=course)


def _status(situation: ReplicaContext, verdict: ReplicaVerdict) -> ReplicaStatus:
    old, reason = situation.old, verdict.explanation.reason.value
    changed = (old.phase, old.reason) != (verdict.phase, reason) or old.since is None
    counts = situation.counted
    return old.model_copy(
        update={
            "phase": verdict.phase,
            "reason": reason,
            "message": verdict.explanation.message,
            "since": situation.now if changed else old.since,
            "attempt": counts.attempt,
            "pod": counts.pod,
            "node": _node(situation),
            "restarts": counts.restarts,
            "simulator_restarts": counts.simulator_restarts,
            "furthest_step": counts.furthest_step,
            "fruitless": counts.fruitless,
            "last_attempt": last_attempt(situation, verdict if verdict.phase in TERMINAL else None),
            "memory_kills": memory_kills(situation),
            **progress(situation, verdict.phase),
        }
    )


def _node(situation: ReplicaContext) -> str | None:
    """Return the node of the newest pod; if no pod exists, the node in the stored status."""
    pod = situation.seen.pod
    return situation.old.node if pod is None else one_line(pod.node, LONGEST_NODE) or None


def judge(situation: ReplicaContext) -> tuple[ReplicaVerdict, ReplicaActions]:
    """Return the phase, reason and actions of a replica: the first check of each list that holds decides."""
    ends = _findings(ENDS, situation)
    reasons = [(kind, finding) for kind, check in REASONS if (finding := check(situation)) is not None]
    kind, shown = next((kind, finding) for kind, finding in reasons if finding.left_s <= 0)
    causes = tuple(finding for kind, finding in reasons if kind is CheckKind.COUNTED)
    stops = _findings(STOPS, replace(situation, shown=shown.explanation, causes=causes))
    asked = (*ends, *stops, *(finding for _, finding in reasons))
    waits = tuple(finding.wait for finding in asked if finding.wait is not None)
    if (end := _first(ends)) is not None:
        return _verdict(situation, end), ReplicaActions(waits=waits)
    stop = _first(stops)
    # The replica has no Job that could be stopped, and the operator will not create one.
    if stop is not None and situation.seen.job is None:
        return ReplicaVerdict(phase=Phase.FAILED, explanation=stop.explanation), ReplicaActions()
    replaced = kind is CheckKind.COUNTED and stop is None
    waits_to_step = failure_checks.FIRST_STEP in {wait.key for wait in waits}
    course = ReplicaActions(
        stop=None if stop is None else stop.explanation,
        replace=shown.explanation if replaced else None,
        left_s=tuple(finding.left_s for finding in asked if finding.left_s > 0),
        waits=waits,
        trouble=failure_checks.trouble(situation, shown.explanation) if waits_to_step else None,
    )
    return _verdict(situation, _refused(situation, shown) if replaced else shown), course


def _findings(checks: Sequence[Check], situation: ReplicaContext) -> list[Finding]:
    return [finding for check in checks if (finding := check(situation)) is not None]


def _first(findings: Sequence[Finding]) -> Finding | None:
    """Return the first finding that holds now."""
    return next((finding for finding in findings if finding.left_s <= 0), None)


def _refused(situation: ReplicaContext, shown: Finding) -> Finding:
    """Return the reason to replace a pod, with the API server's message if it refused the eviction."""
    if not situation.seen.denied:
        return shown
    words = one_line(
        f"{shown.explanation.message}; it is not replaced yet: {situation.seen.denied}", LONGEST_MESSAGE
    )
    return replace(shown, explanation=Explanation(reason=shown.explanation.reason, message=words))


def _verdict(situation: ReplicaContext, finding: Finding) -> ReplicaVerdict:
    phase = Phase.RUNNING if current_state.runs(situation) else Phase.PENDING
    return ReplicaVerdict(phase=finding.phase or phase, explanation=finding.explanation)
