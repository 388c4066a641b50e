"""What is to be done, in order: stop what has to end, suspend or resume, then create what is missing."""

from collections.abc import Iterator, Sequence

from palaestra.api import TrainingJob
from palaestra.api.status import TERMINAL, ReplicaStatus
from palaestra.decide.decision import Action, Create, SetSuspend, Stop
from palaestra.decide.preparing import Prepared
from palaestra.decide.replicas import Decided
from palaestra.observe.views import Observed, ReplicaObserved
from palaestra.plan import Object, Plan, ReplicaPlan


def actions(
    job: TrainingJob, observed: Observed, prepared: Prepared, each: Sequence[Decided]
) -> tuple[Action, ...]:
    """Return everything that is to be done about the replicas of a job."""
    stops = tuple(_stops(observed, each))
    stopping = {stop.replica for stop in stops}
    switches = tuple(it for it in _switches(job, observed, each) if it.replica not in stopping)
    creations: tuple[Create, ...] = ()
    if prepared.plan is not None and job.status.release is not None:
        creations = wanted(prepared.plan, observed, tuple(it.status for it in each))
    return (*stops, *switches, *creations)


def wanted(plan: Plan, observed: Observed, replicas: Sequence[ReplicaStatus]) -> tuple[Create, ...]:
    """Return what is missing of the objects of replicas that have not ended, in the order of creation.

    A Job waits for the pods of the one before it: two pods of a replica would write to one volume. To a
    Job that is there belong the volumes that it names, whatever a newer release would call them.
    """
    going_on = [each for each in observed.replicas if replicas[each.index].phase not in TERMINAL]
    if not going_on:
        return ()
    missing = [
        Create(object=thing) for thing in (plan.network_policy,) if thing and not _there(thing, observed)
    ]
    for seen in going_on:
        things = _things(plan.replicas[seen.index], seen)
        missing += [Create(object=it, replica=seen.index) for it in things if not _there(it, observed)]
    return tuple(missing)


def _things(planned: ReplicaPlan, seen: ReplicaObserved) -> tuple[Object, ...]:
    volumes = [thing for thing in (planned.config_map, planned.claim) if thing is not None]
    if seen.job is not None:
        return tuple(each for each in volumes if each["metadata"]["name"] in seen.job.volumes)
    if seen.obstacle is not None or seen.in_the_way or any(not pod.ended for pod in seen.pods):
        return ()
    return (*volumes, planned.job)


def _there(thing: Object, observed: Observed) -> bool:
    return (thing["kind"], thing["metadata"]["name"]) in observed.present


def _stops(observed: Observed, each: Sequence[Decided]) -> Iterator[Stop]:
    """Yield the stop of each replica that has to end and was not stopped yet."""
    for seen, it in zip(observed.replicas, each, strict=True):
        if seen.job is None or seen.job.end is not None:
            continue
        if it.stop is not None and seen.job.stopped is None:
            yield Stop(job=seen.job.name, replica=seen.index, reason=it.stop.reason, message=it.stop.message)


def _switches(job: TrainingJob, observed: Observed, each: Sequence[Decided]) -> Iterator[SetSuspend]:
    """Yield what makes the Jobs as suspended as the spec; with a queue that is Kueue's."""
    if job.spec.scheduling.queue_name is not None:
        return
    for seen, it in zip(observed.replicas, each, strict=True):
        ours = seen.job is not None and seen.job.end is None and not seen.job.queue
        going_on = ours and it.status.phase not in TERMINAL
        if seen.job is not None and going_on and seen.job.suspended != job.spec.suspend:
            yield SetSuspend(job=seen.job.name, replica=seen.index, suspend=job.spec.suspend)
