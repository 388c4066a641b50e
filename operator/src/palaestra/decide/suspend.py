"""Find the client that suspended or resumed a Job: the operator, a queue, or another field manager."""

from palaestra.api import TrainingJob
from palaestra.api.status import PodReference
from palaestra.decide.restart_counts import lives
from palaestra.observe.models import JobView, PodView, ReplicaObserved, Suspended

BY_SPEC = "spec.suspend; set it to false to continue"
UNKNOWN_CLIENT = "somebody else"  # a message names this client if the Job has no field manager


def set_last(seen: JobView) -> bool:
    """Return the `spec.suspend` that the operator last set on a Job, according to the Job's annotation.

    If another client has removed the annotation, the current value counts as set by the operator.
    """
    return seen.suspended if seen.suspend_set is None else seen.suspend_set


def to_set(job: TrainingJob, seen: JobView | None, *, suspend: bool | None = None) -> bool:
    """Return whether the operator must suspend or resume a Job; only Kueue does so for a Job with a queue.

    `suspend` is the wanted value; None: the value in the spec.

    The wanted value is compared with the value that the operator set last, not with the current value.
    Otherwise the operator and another client would undo each other's writes forever.
    """
    if seen is None or job.spec.scheduling.queue_name is not None or seen.queue or seen.end is not None:
        return False
    return set_last(seen) != (job.spec.suspend if suspend is None else suspend)


def to_resume(job: TrainingJob, seen: JobView | None) -> bool:
    """Return whether the operator must resume a Job, which then creates a new pod."""
    return not job.spec.suspend and to_set(job, seen)


def mark(seen: ReplicaObserved, current: PodReference | None, *, suspend: bool) -> Suspended | None:
    """Return the mark about the current pod, for the patch that suspends or resumes a Job; None: no mark.

    A pod may be created before the suspension and be observed only after the suspension. Then the patch that
    resumes the Job adds the mark. This pod existed before the suspension, because a suspended Job does not
    create pods.
    """
    job = seen.job
    if job is None or current is None or job.suspended == suspend:
        return None
    named = job.suspension is not None and job.suspension.pod == current.uid
    lived = seen.pod is not None and lives(seen.pod)
    # If the Job is suspended again before the next pod is created, its annotation about the pod is still
    # correct.
    if suspend:
        return None if named and not lived else Suspended(pod=current.uid, lived=lived)
    late = job.suspend_set is True and not named
    return Suspended(pod=current.uid, lived=True) if late else None


def ended_by_suspension(seen: ReplicaObserved, pod: PodView) -> bool:
    """Return whether a pod was deleted because the operator suspended its Job.

    The operator may have resumed the Job since.
    """
    mark = seen.job.suspension if seen.job is not None else None
    return mark is not None and mark.lived and mark.pod == pod.uid and pod.gone_by is not None


def overruled(job: TrainingJob, seen: JobView) -> bool:
    """Return whether another client has changed the Job's `suspend` since the operator set it."""
    queued = job.spec.scheduling.queue_name is not None or seen.queue
    return not queued and seen.end is None and seen.suspended != set_last(seen)


def suspended_by(job: TrainingJob, seen: ReplicaObserved) -> str:
    """Return the client or field that suspended the Job of a replica, with the way to resume it."""
    if seen.job is None or not overruled(job, seen.job):
        return BY_SPEC
    return (
        f"{seen.switcher or UNKNOWN_CLIENT}, not by spec.suspend; "
        f"the replica continues when Job {seen.job.name} is resumed"
    )


def unheeded(job: TrainingJob, seen: ReplicaObserved) -> str:
    """Return the text about a `spec.suspend` that has no effect on a replica; "" in all other cases."""
    if seen.job is None or not job.spec.suspend or seen.job.suspended:
        return ""
    if seen.job.queue:
        return f"; spec.suspend has no effect, because queue {seen.job.queue} starts and stops it"
    if overruled(job, seen.job):
        return f"; resumed by {seen.switcher or UNKNOWN_CLIENT} although spec.suspend is true"
    return ""
