"""Checks that stop a replica for good: limits in the job's spec, and causes that a retry cannot remove.

While a replica waits for its first step, `trouble` keeps the last cause of the delay for a minute, because a
kubelet that restarts does not report the cause for a moment.
"""

from dataclasses import replace

from palaestra.api.reasons import LONGEST_MESSAGE, Reason
from palaestra.api.text import one_line
from palaestra.decide.clocks import Wait, WaitingReason
from palaestra.decide.current_state import runs
from palaestra.decide.explanation import Explanation, explain
from palaestra.decide.pod_end import mark_of, storage_eviction
from palaestra.decide.replica_context import Finding, ReplicaContext, after, first_waiting, found
from palaestra.decide.restart_counts import failed_by_itself, has_run
from palaestra.decide.waiting_reasons import of_image

FIRST_STEP = ("first step",)  # the key of the wait for the first step
MOMENT_S = 60  # seconds within which a kubelet that restarts or retries reports a reason again

_NO_TROUBLE = frozenset({Reason.STARTING, Reason.TRAINING, Reason.DISRUPTED, Reason.INTERRUPTED})


def active_deadline(situation: ReplicaContext) -> Finding | None:
    """The job was active for `activeDeadlineSeconds`."""
    if situation.active_left_s is None or (seconds := situation.job.spec.active_deadline_seconds) is None:
        return None
    return Finding(
        left_s=situation.active_left_s, explanation=explain(Reason.DEADLINE_EXCEEDED, seconds=seconds)
    )


def cannot_be_planned(situation: ReplicaContext) -> Finding | None:
    """The replica's objects cannot be planned from the spec, and a spec does not change."""
    if situation.seen.job is not None or situation.hold is None or not situation.hold.final:
        return None
    return Finding(explanation=situation.hold.explanation)


def image_name_is_invalid(situation: ReplicaContext) -> Finding | None:
    """The name of an image is invalid, so no registry can have the image."""
    stuck = first_waiting(situation.pod, frozenset({"InvalidImageName"}))
    return None if stuck is None else of_image(stuck)


def no_progress(situation: ReplicaContext) -> Finding | None:
    """Pods of the replica end early too often without a new step; Kubernetes has no limit of its own."""
    limit = situation.job.spec.most_fruitless
    pods = situation.counted.fruitless + _taken_and_not_replaced(situation)
    if limit == 0 or pods < limit:
        return None
    evictions = (storage_eviction(pod) for pod in reversed(situation.seen.pods) if pod.ended)
    cause = next(evictions, None)  # the eviction of the pod that ended last
    return Finding(explanation=cause) if cause is not None else found(Reason.NO_PROGRESS, pods=pods)


def start_timeout(situation: ReplicaContext) -> Finding | None:
    """The replica has done no step within `startTimeoutSeconds`; the cause of the delay is its reason."""
    if (
        situation.suspended
        or situation.hold is not None
        or situation.counted.furthest_step
        or _is_past_its_start(situation)
        or situation.shown is None
    ):
        return None
    seconds = situation.job.spec.start_timeout_s
    cause, why = trouble(situation, situation.shown), situation.shown.message
    reason = Reason.START_TIMEOUT if cause is None else cause.explanation.reason
    if cause is not None and cause.gone_s is not None:
        why = f"a moment ago: {cause.explanation.message}"
    words = f"no step within {seconds} s, as long as startTimeoutSeconds allows; {why}"
    explanation = Explanation(reason=reason, message=one_line(words, LONGEST_MESSAGE))
    return after(situation, Wait(key=FIRST_STEP, seconds=seconds), explanation)


def trouble(situation: ReplicaContext, shown: Explanation) -> WaitingReason | None:
    """Return the cause that delays the first step; keep it if the kubelet stops reporting it for a moment."""
    if shown.reason not in _NO_TROUBLE:
        return WaitingReason(explanation=shown)
    last, now_s = situation.times.record.troubles.get(situation.seen.index), situation.times.clock_s
    if last is None:
        return None
    gone_s = now_s if last.gone_s is None else last.gone_s
    return replace(last, gone_s=gone_s) if now_s - gone_s <= MOMENT_S else None


def _is_past_its_start(situation: ReplicaContext) -> bool:
    """Return whether the trainer runs and does not report that its simulators still start."""
    return runs(situation) and (situation.seen.polled is None or situation.trains)


def _taken_and_not_replaced(situation: ReplicaContext) -> bool:
    """Return whether the newest pod ended early, and the Job has not created the next pod yet.

    A pod ends early if it is disrupted or interrupted. Kubernetes doubles the wait for the next pod each
    time, so the ended pod is counted at once.
    """
    pod = situation.seen.pod
    if pod is None or not situation.counted.furthest_step or mark_of(situation, pod) is not None:
        return False
    return pod.phase == "Failed" and not failed_by_itself(pod) and has_run(pod)
