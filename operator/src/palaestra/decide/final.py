"""Checks that stop a replica for good: the limits that its author set, and causes that no retry removes."""

from palaestra.api.reasons import Reason
from palaestra.decide.counting import failed_by_itself, has_run
from palaestra.decide.situation import Finding, Situation, first_waiting, found, told
from palaestra.decide.troubles import mark_of, of_image, storage_eviction


def active_deadline(it: Situation) -> Finding | None:
    """The job was active as long as `activeDeadlineSeconds` allows."""
    if it.active_left_s is None or (seconds := it.job.spec.active_deadline_seconds) is None:
        return None
    return Finding(left_s=it.active_left_s, told=told(Reason.DEADLINE_EXCEEDED, seconds=seconds))


def cannot_be_planned(it: Situation) -> Finding | None:
    """No objects can be created from its spec, and a spec does not change."""
    if it.seen.job is not None or it.hold is None or not it.hold.final:
        return None
    return Finding(told=it.hold.told)


def image_name_is_invalid(it: Situation) -> Finding | None:
    """No registry has an image of such a name."""
    stuck = first_waiting(it.pod, frozenset({"InvalidImageName"}))
    return None if stuck is None else of_image(stuck)


def no_progress(it: Situation) -> Finding | None:
    """Its pods are interrupted again and again without progress; Kubernetes has no limit for that."""
    limit = it.job.spec.most_fruitless
    pods = it.counted.fruitless + _taken_and_not_replaced(it)
    if limit == 0 or pods < limit:
        return None
    evictions = (storage_eviction(pod) for pod in reversed(it.seen.pods) if pod.ended)
    cause = next(evictions, None)  # of the last that ended
    return Finding(told=cause) if cause is not None else found(Reason.NO_PROGRESS, pods=pods)


def _taken_and_not_replaced(it: Situation) -> bool:
    """Return whether the newest pod was interrupted; Kubernetes doubles the wait for the next each time."""
    pod = it.seen.pod
    if pod is None or not it.counted.furthest_step or mark_of(it, pod) is not None:
        return False
    return pod.phase == "Failed" and not failed_by_itself(pod) and has_run(pod)
