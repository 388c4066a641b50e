"""What suspended or resumed a Job: the operator, a queue, or another field manager."""

from palaestra.api import TrainingJob
from palaestra.api.status import PodReference
from palaestra.decide.counting import lives
from palaestra.observe.views import JobView, Observed, PodView, ReplicaObserved, Suspended

BY_SPEC = "spec.suspend; set it to false to go on from the last checkpoint"
SOMEBODY = "somebody else"  # where no field manager is known


def set_last(job: TrainingJob, seen: JobView) -> bool:
    """Return the `spec.suspend` that the operator set last on a Job of its own, by the Job's annotation.

    A Job of an earlier release has no annotation and is taken as it stands: that release kept it as the spec
    was, so a difference is somebody else's doing, unless the spec changed since the last status write.
    """
    if seen.suspend_set is not None:
        return seen.suspend_set
    changed = job.status.observed_generation != job.metadata.generation
    return seen.suspended if changed else job.spec.suspend


def to_set(job: TrainingJob, seen: JobView | None) -> bool:
    """Return whether the operator has to suspend or resume a Job; with a queue that is Kueue's.

    A Job is compared with what the operator set last, not with what it is: what anybody else makes of it
    since is theirs, or the two would undo each other's writes for ever.
    """
    if seen is None or job.spec.scheduling.queue_name is not None or seen.queue or seen.end is not None:
        return False
    return set_last(job, seen) != job.spec.suspend


def seen_generation(job: TrainingJob, observed: Observed) -> int | None:
    """Return the generation of the spec that the status has heard of.

    It stays behind while a Job without the annotation waits to be as the spec says: a patch that is refused,
    or held back, would otherwise be taken for done.
    """
    jobs = (each.job for each in observed.replicas if each.job is not None and each.job.stopped is None)
    waits = any(each.suspend_set is None and to_set(job, each) for each in jobs)
    return job.status.observed_generation if waits else job.metadata.generation


def to_resume(job: TrainingJob, seen: JobView | None) -> bool:
    """Return whether the operator has to resume a Job: its next pod would be a new one."""
    return not job.spec.suspend and to_set(job, seen)


def mark(seen: ReplicaObserved, current: PodReference | None, *, suspend: bool) -> Suspended | None:
    """Return what the patch that suspends or resumes a Job writes of the current pod; None: nothing.

    A pod may be made before the suspension and seen after it. The patch that resumes names such a pod: a
    suspended Job makes none.
    """
    job = seen.job
    if job is None or current is None or job.suspended == suspend:
        return None
    named = job.suspension is not None and job.suspension.pod == current.uid
    lived = seen.pod is not None and lives(seen.pod)
    if suspend:  # again, before the next pod is made: the mark that is there is right
        return None if named and not lived else Suspended(pod=current.uid, lived=lived)
    late = job.suspend_set is True and not named
    return Suspended(pod=current.uid, lived=True) if late else None


def ended_by_suspension(seen: ReplicaObserved, pod: PodView) -> bool:
    """Return whether a pod was deleted because the operator suspended its Job; it may be resumed by now."""
    mark = seen.job.suspension if seen.job is not None else None
    return mark is not None and mark.lived and mark.pod == pod.uid and pod.gone_by is not None


def overruled(job: TrainingJob, seen: JobView) -> bool:
    """Return whether somebody else has suspended or resumed a Job since the operator set it."""
    queued = job.spec.scheduling.queue_name is not None or seen.queue
    return not queued and seen.end is None and seen.suspended != set_last(job, seen)


def suspended_by(job: TrainingJob, seen: ReplicaObserved) -> str:
    """Return what suspended the Job of a replica, with what resumes it."""
    if seen.job is None or not overruled(job, seen.job):
        return BY_SPEC
    return f"{seen.switcher or SOMEBODY}, not by spec.suspend; it goes on when Job {seen.job.name} is resumed"


def unheeded(job: TrainingJob, seen: ReplicaObserved) -> str:
    """Return what to say of a suspension that has no effect; "": there is none."""
    if seen.job is None or not job.spec.suspend or seen.job.suspended:
        return ""
    if seen.job.queue:
        return f"; spec.suspend is not heeded, as queue {seen.job.queue} starts and stops it"
    if overruled(job, seen.job):
        return f"; resumed by {seen.switcher or SOMEBODY} though spec.suspend is true"
    return ""
