"""The actions for a job, in order: stop, replace pods, suspend or resume, discard, create missing objects."""

from collections.abc import Iterator, Sequence

from palaestra.api import TrainingJob
from palaestra.api.status import TERMINAL, ReplicaStatus
from palaestra.decide.decision import Action, Basis, Create, Discard, Replace, SetSuspend, Stop
from palaestra.decide.preparing import Prepared
from palaestra.decide.replicas import Decided
from palaestra.decide.suspending import mark, to_resume, to_set
from palaestra.objects import Object
from palaestra.observe.views import JobView, Observed, PodView, ReplicaObserved
from palaestra.plan import Plan, ReplicaPlan


def actions(
    job: TrainingJob, observed: Observed, prepared: Prepared, each: Sequence[Decided]
) -> tuple[Action, ...]:
    """Return the actions for the replicas of a job."""
    stops = tuple(_stops(observed, each))
    stopping = {stop.replica for stop in stops}
    switches = tuple(it for it in _switches(job, observed, prepared, each) if it.replica not in stopping)
    creations: tuple[Create, ...] = ()
    if prepared.plan is not None and job.status.release is not None:
        creations = wanted(prepared.plan, observed, tuple(it.status for it in each))
    return (*stops, *_replacements(observed, each), *switches, *_discards(job, observed), *creations)


def wanted(plan: Plan, observed: Observed, replicas: Sequence[ReplicaStatus]) -> tuple[Create, ...]:
    """Return the missing objects of replicas that have not ended, in the order of creation.

    A Job is created only after the pods of the Job before it have ended: two pods of a replica would write to
    one volume. If a Job exists, its volumes have the names in it, even if a newer release names them
    otherwise.
    """
    going_on = [each for each in observed.replicas if replicas[each.index].phase not in TERMINAL]
    if not going_on:
        return ()
    missing = [
        Create(object=thing) for thing in (plan.network_policy,) if thing and not _there(thing, observed)
    ]
    for seen in going_on:
        if (planned := plan.replicas.get(seen.index)) is None:
            continue
        things = _things(planned, seen)
        missing += [Create(object=it, replica=seen.index) for it in things if not _there(it, observed)]
    return tuple(missing)


def _things(planned: ReplicaPlan, seen: ReplicaObserved) -> tuple[Object, ...]:
    volumes = [thing for thing in (planned.config_map, planned.claim) if thing is not None]
    if seen.job is not None:
        return tuple(each for each in volumes if each["metadata"]["name"] in seen.job.volumes)
    if seen.obstacle is not None or seen.in_the_way or seen.former or any(not it.ended for it in seen.pods):
        return ()
    return (*volumes, planned.job)


def _there(thing: Object, observed: Observed) -> bool:
    return (thing["kind"], thing["metadata"]["name"]) in observed.present


def _stops(observed: Observed, each: Sequence[Decided]) -> Iterator[Stop]:
    """Yield a stop for each replica that has to end and was not stopped yet."""
    for seen, it in zip(observed.replicas, each, strict=True):
        if seen.job is None or seen.job.end is not None:
            continue
        if (stop := it.course.stop) is not None and seen.job.stopped is None:
            yield Stop(
                job=seen.job.name,
                replica=seen.index,
                reason=stop.reason,
                message=stop.message,
                basis=_basis(seen.job, seen.pods),
            )


def _replacements(observed: Observed, each: Sequence[Decided]) -> Iterator[Replace]:
    """Yield a replacement for each pod that no kubelet repairs, unless the pod is being deleted."""
    for seen, it in zip(observed.replicas, each, strict=True):
        why = it.course.replace
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
            basis=_basis(seen.job, seen.pods),
        )


def _switches(
    job: TrainingJob, observed: Observed, prepared: Prepared, each: Sequence[Decided]
) -> Iterator[SetSuspend]:
    """Yield a change for each Job whose `suspend` is not as in the spec; a hold prevents a resumption."""
    for seen, it in zip(observed.replicas, each, strict=True):
        held = prepared.closed is not None and to_resume(job, seen.job)
        going_on = it.status.phase not in TERMINAL and not held
        if seen.job is not None and going_on and to_set(job, seen.job):
            yield SetSuspend(
                job=seen.job.name,
                replica=seen.index,
                suspend=job.spec.suspend,
                mark=mark(seen, it.status.pod, suspend=job.spec.suspend),
                basis=_basis(seen.job),
            )


def _discards(job: TrainingJob, observed: Observed) -> Iterator[Discard]:
    """Yield the deletion of each stopped and suspended Job, once the status says that its replica ended.

    The deadline of a suspended Job does not run, so nothing else would ever end it.
    """
    ended = {each.index for each in job.status.replicas if each.phase in TERMINAL}
    for seen in observed.replicas:
        if seen.index not in ended or seen.job is None or seen.job.end is not None or seen.job.deleting:
            continue
        if seen.job.suspended and seen.job.stopped is not None:
            yield Discard(job=seen.job.name, replica=seen.index, basis=_basis(seen.job))


def _basis(job: JobView, pods: Sequence[PodView] = ()) -> Basis:
    return Basis(uid=job.uid, version=job.version, pods=frozenset((each.uid, each.version) for each in pods))
