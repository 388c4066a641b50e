"""Checks that stop a replica for good: limits that its author set, and causes that a retry cannot remove."""

from palaestra.api.reasons import Reason
from palaestra.decide.replica_context import Finding, ReplicaContext, explain, first_waiting, found
from palaestra.decide.restart_counts import failed_by_itself, has_run
from palaestra.decide.waiting_reasons import mark_of, of_image, storage_eviction


def active_deadline(situation: ReplicaContext) -> Finding | None:
    """The job was active as long as `activeDeadlineSeconds` allows."""
    if situation.active_left_s is None or (seconds := situation.job.spec.active_deadline_seconds) is None:
        return None
    return Finding(
        left_s=situation.active_left_s, explanation=explain(Reason.DEADLINE_EXCEEDED, seconds=seconds)
    )


def cannot_be_planned(situation: ReplicaContext) -> Finding | None:
    """Its objects cannot be created from its spec, and a spec does not change."""
    if situation.seen.job is not None or situation.hold is None or not situation.hold.final:
        return None
    return Finding(explanation=situation.hold.explanation)


def image_name_is_invalid(situation: ReplicaContext) -> Finding | None:
    """The name of an image is invalid, so it is in no registry."""
    stuck = first_waiting(situation.pod, frozenset({"InvalidImageName"}))
    return None if stuck is None else of_image(stuck)


def no_progress(situation: ReplicaContext) -> Finding | None:
    """Its pods are interrupted again and again without progress; Kubernetes has no limit for that."""
    limit = situation.job.spec.most_fruitless
    pods = situation.counted.fruitless + _taken_and_not_replaced(situation)
    if limit == 0 or pods < limit:
        return None
    evictions = (storage_eviction(pod) for pod in reversed(situation.seen.pods) if pod.ended)
    cause = next(evictions, None)  # of the last that ended
    return Finding(explanation=cause) if cause is not None else found(Reason.NO_PROGRESS, pods=pods)


def _taken_and_not_replaced(situation: ReplicaContext) -> bool:
    """Return whether the newest pod was interrupted; Kubernetes doubles the wait for the next each time."""
    pod = situation.seen.pod
    if pod is None or not situation.counted.furthest_step or mark_of(situation, pod) is not None:
        return False
    return pod.phase == "Failed" and not failed_by_itself(pod) and has_run(pod)
