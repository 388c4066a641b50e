"""The actions for a job, in order: stop, replace pods, suspend or resume, discard, create missing objects.

The last action is the deletion of an ended TrainingJob, after its time to live has passed.
"""

from collections.abc import Iterator, Sequence
from datetime import datetime

from palaestra.api import TrainingJob
from palaestra.api.status import TERMINAL, ReplicaStatus, Status
from palaestra.decide.clocks import after, seconds_between
from palaestra.decide.decision import Action, Basis, Create, Delete, Discard, Replace, SetSuspend, Stop
from palaestra.decide.preconditions import Prepared
from palaestra.decide.replica_policy import Decided
from palaestra.decide.suspend import mark, to_set
from palaestra.objects import Object
from palaestra.observe.models import JobView, Observed, PodView, ReplicaObserved
from palaestra.plan import Plan, ReplicaPlan


def actions(
    job: TrainingJob, observed: Observed, prepared: Prepared, decided: Sequence[Decided]
) -> tuple[Action, ...]:
    """Return the actions for the replicas of a job."""
    stops = tuple(_stops(observed, decided))
    stopping = {stop.replica for stop in stops}
    switches = tuple(
        switch for switch in _switches(job, observed, prepared, decided) if switch.replica not in stopping
    )
    creations: tuple[Create, ...] = ()
    if prepared.plan is not None and job.status.release is not None:
        creations = wanted(prepared.plan, observed, tuple(replica.status for replica in decided))
    return (*stops, *_replacements(observed, decided), *switches, *_discards(job, observed), *creations)


def wanted(plan: Plan, observed: Observed, replicas: Sequence[ReplicaStatus]) -> tuple[Create, ...]:
    """Return the missing objects of unfinished replicas, in the order of creation.

    A Job is created only after the pods of the previous Job have ended, because two pods of a replica would
    write to one volume. If a Job exists, missing volumes are created only under the names in this Job, even
    if a newer release uses other names.
    """
    going_on = [replica for replica in observed.replicas if replicas[replica.index].phase not in TERMINAL]
    if not going_on:
        return ()
    missing = [
        Create(object=thing) for thing in (plan.network_policy,) if thing and not _there(thing, observed)
    ]
    for seen in going_on:
        if (planned := plan.replicas.get(seen.index)) is None:
            continue
        things = _things(planned, seen)
        missing += [
            Create(object=thing, replica=seen.index) for thing in things if not _there(thing, observed)
        ]
    return tuple(missing)


def _things(planned: ReplicaPlan, seen: ReplicaObserved) -> tuple[Object, ...]:
    volumes = [thing for thing in (planned.config_map, planned.claim) if thing is not None]
    if seen.job is not None:
        return tuple(volume for volume in volumes if volume["metadata"]["name"] in seen.job.volumes)
    if seen.obstacle is not None or seen.in_the_way or seen.former or any(not pod.ended for pod in seen.pods):
        return ()
    return (*volumes, planned.job)


def _there(thing: Object, observed: Observed) -> bool:
    return (thing["kind"], thing["metadata"]["name"]) in observed.present


def _stops(observed: Observed, decided: Sequence[Decided]) -> Iterator[Stop]:
    """Yield a `Stop` for each replica that must end and was not stopped yet."""
    for seen, replica in zip(observed.replicas, decided, strict=True):
        if seen.job is None or seen.job.end is not None:
            continue
        if (stop := replica.course.stop) is not None and seen.job.stopped is None:
            yield Stop(
                job=seen.job.name,
                replica=seen.index,
                reason=stop.reason,
                message=stop.message,
                basis=_basis(seen.job, seen.pods),
            )


def _replacements(observed: Observed, decided: Sequence[Decided]) -> Iterator[Replace]:
    """Yield a `Replace` for each pod that must be replaced and is not being deleted."""
    for seen, replica in zip(observed.replicas, decided, strict=True):
        why = replica.course.replace
        if why is None or seen.job is None or seen.pod is None or seen.pod.gone_by is not None:
            continue
        mark = seen.job.replaced
        marked = mark is not None and mark.pod == seen.pod.uid
        yield Replace(
            job=seen.job.name,
            replica=seen.index,
            pod=seen.pod.name,
            uid=seen.pod.uid,
            times=(mark.times if mark is not None else 0) + (not marked),
            reason=why.reason,
            message=why.message,
            marked=marked,
            ended=seen.pod.ended,
            basis=_basis(seen.job, seen.pods),
        )


def _switches(
    job: TrainingJob, observed: Observed, prepared: Prepared, decided: Sequence[Decided]
) -> Iterator[SetSuspend]:
    """Yield a `SetSuspend` for each Job whose `suspend` differs from the spec; a hold prevents a resumption.

    The Job of a lost run is suspended, because its trainer would start at step 0.
    """
    for seen, replica in zip(observed.replicas, decided, strict=True):
        suspend = job.spec.suspend or seen.index in prepared.lost
        held = prepared.closed is not None and not suspend
        going_on = replica.status.phase not in TERMINAL and not held
        if seen.job is not None and going_on and to_set(job, seen.job, suspend=suspend):
            yield SetSuspend(
                job=seen.job.name,
                replica=seen.index,
                suspend=suspend,
                mark=mark(seen, replica.status.pod, suspend=suspend),
                basis=_basis(seen.job),
            )


def _discards(job: TrainingJob, observed: Observed) -> Iterator[Discard]:
    """Yield a `Discard` for each stopped and suspended Job whose replica has ended in the stored status.

    The deadline of a suspended Job does not run, so Kubernetes would never end the Job.
    """
    ended = {replica.index for replica in job.status.replicas if replica.phase in TERMINAL}
    for seen in observed.replicas:
        if seen.index not in ended or seen.job is None or seen.job.end is not None or seen.job.deleting:
            continue
        if seen.job.suspended and seen.job.stopped is not None:
            yield Discard(job=seen.job.name, replica=seen.index, basis=_basis(seen.job))


def _basis(job: JobView, pods: Sequence[PodView] = ()) -> Basis:
    return Basis(uid=job.uid, version=job.version, pods=frozenset((pod.uid, pod.version) for pod in pods))


def expires(status: Status, ttl_s: int | None) -> datetime | None:
    """Return the time at which to delete an ended job; None if it has not ended or has no time to live."""
    if ttl_s is None or status.phase not in TERMINAL or status.completion_time is None:
        return None
    return after(status.completion_time, ttl_s)


def expired(
    name: str, uid: str | None, at: datetime | None, status: Status, now: datetime
) -> tuple[Delete, ...]:
    """Return the deletion of the TrainingJob if the time `at` has passed."""
    if at is None or at > now or uid is None:
        return ()
    return (Delete(name=name, uid=uid, after_s=seconds_between(status.completion_time or now, now)),)
