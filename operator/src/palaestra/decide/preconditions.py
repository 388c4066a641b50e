"""Plan the missing objects, or return the hold that keeps the job from being planned.

A replica whose objects all exist is not planned. So a later change of its worlds' ConfigMaps, or a newer
release, has no effect on this replica.
"""

import dataclasses
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

from palaestra.api import Driver, TrainingJob, broken_guards
from palaestra.api.reasons import Reason
from palaestra.api.status import TERMINAL, LostPart, LostRun
from palaestra.decide.allow_lists import not_allowed
from palaestra.decide.explanation import Hold, held
from palaestra.decide.lost_runs import lost_runs, why_lost
from palaestra.decide.suspend import to_resume
from palaestra.errors import WorldCheckTooCostly, WorldRefused, WorldUnchecked
from palaestra.observe.cached_job import Lacking
from palaestra.observe.json_access import part
from palaestra.observe.models import Observed, ReferencedObject, ReferenceKind, ReplicaObserved
from palaestra.observe.references import open_to_jobs, references
from palaestra.plan import ClusterLayout, GivenWorld, Images, Plan, PlanError, given_worlds, plan
from palaestra.plan.claim import claim_name
from palaestra_sim.errors import WorldError


@dataclass(frozen=True, slots=True, kw_only=True)
class Prepared:
    """The plan with its images, or the hold that prevents it; both are None if all objects exist.

    `closed` is the hold that keeps existing Jobs from being resumed: an object that they use is no longer
    labeled for jobs. `lost` has the lost runs by replica; these replicas must not train.
    """

    plan: Plan | None = None
    images: Images | None = None
    hold: Hold | None = None
    closed: Hold | None = None
    lost: Mapping[int, LostRun] = dataclasses.field(default_factory=dict)

    def hold_of(self, job: TrainingJob, seen: ReplicaObserved) -> Hold | None:
        """Return the hold that keeps a replica from being planned or resumed."""
        if (lost := self.lost.get(seen.index)) is not None:
            return Hold(explanation=why_lost(job, seen.index, lost))
        if seen.job is None:
            return self.hold
        return self.closed if to_resume(job, seen.job) else None


Check = Callable[[TrainingJob, Observed], Hold | None]

_NOT_FOR_JOBS = {
    ReferenceKind.CONFIG_MAP: Reason.CONFIG_MAP_NOT_FOR_JOBS,
    ReferenceKind.SECRET: Reason.SECRET_NOT_FOR_JOBS,
    ReferenceKind.CLAIM: Reason.CLAIM_NOT_FOR_JOBS,
}
_CREATE = 'create it with the label palaestra.dev/for-jobs: "true"'
_MISSING = {ReferenceKind.SECRET: Reason.SECRET_MISSING, ReferenceKind.CLAIM: Reason.CLAIM_MISSING}


def prepare(job: TrainingJob, observed: Observed, layout: ClusterLayout) -> Prepared:
    """Return the plan of a job's missing objects, with the images from the job's acceptance."""
    closed = sources_are_still_for_jobs(job, observed) if resuming(job, observed) else None
    lost = _lost(job, observed)
    if complete(job, observed):
        return Prepared(closed=closed, lost=lost)
    return replace(_planned(job, observed, layout), closed=closed, lost=lost)


def _planned(job: TrainingJob, observed: Observed, layout: ClusterLayout) -> Prepared:
    if (hold := _held(job, observed, layout)) is not None:
        return Prepared(hold=hold)
    layout = _at_acceptance(job, layout)
    try:
        planned = plan(
            job, layout, _worlds(job, observed), _lacking(job, observed), verdicts=observed.verdicts
        )
        return Prepared(plan=planned, images=layout.images)
    except WorldUnchecked:
        return Prepared(hold=held(Reason.CHECKING_WORLDS))
    except WorldCheckTooCostly as error:
        return Prepared(hold=held(Reason.WORLD_TOO_COSTLY, final=True, problem=error))
    except (WorldError, WorldRefused) as error:
        mendable = any(group.world.config_map for group in job.spec.simulators)
        return Prepared(hold=held(Reason.WORLD_INVALID, final=not mendable, problem=error))
    except PlanError as error:
        return Prepared(hold=held(Reason.INVALID_SPEC, final=True, problem=error))


def worlds_to_check(job: TrainingJob, observed: Observed, layout: ClusterLayout) -> tuple[GivenWorld, ...]:
    """Return the worlds that must be checked for the plan of a job; empty if the job is not planned next."""
    if complete(job, observed) or _held(job, observed, layout) is not None:
        return ()
    try:
        return given_worlds(job, _worlds(job, observed))
    except PlanError:  # the plan will fail with the same error, so the results of the checks do not matter
        return ()


def _held(job: TrainingJob, observed: Observed, layout: ClusterLayout) -> Hold | None:
    """Return the first hold; the allow lists are checked before acceptance only."""
    if job.status.release is None and (hold := _held_as_new(job, layout)) is not None:
        return hold
    return next((found for check in HOLDS if (found := check(job, observed))), None)


def _held_as_new(job: TrainingJob, layout: ClusterLayout) -> Hold | None:
    if problems := broken_guards(job):
        return held(Reason.INVALID_SPEC, final=True, problem="; ".join(problems))
    return webots_has_an_image(job, layout) or not_allowed(job, layout.allowed)


def webots_has_an_image(job: TrainingJob, layout: ClusterLayout) -> Hold | None:
    """Palaestra publishes no image of Webots, so a pod without such an image would never start."""
    if layout.has_webots_image:
        return None
    for place, group in enumerate(job.spec.simulators):
        if group.driver is Driver.WEBOTS and group.image is None:
            return held(Reason.NO_IMAGE, field=f"spec.simulators[{place}].image")
    return None


def wants_whole(job: TrainingJob, observed: Observed, layout: ClusterLayout, lacks: Lacking | None) -> bool:
    """Return whether the whole job must be read before `prepare`, because the job is planned next.

    `lacks` is the part of the API server's object that the trimmed `job` lacks. While a hold remains, the
    worlds are not read.
    """
    if observed.worlds_wait:
        return False
    if lacks is Lacking.FIELDS and resuming(job, observed):
        return True
    if lacks is None or complete(job, observed):
        return False
    return lacks is Lacking.FIELDS or _held(job, observed, layout) is None


def lacking_claims(job: TrainingJob, observed: Observed) -> tuple[str, ...]:
    """Return the names of the missing claims of unfinished replicas that have trained."""
    return tuple(
        claim_name(job.metadata.name, index, job.metadata.uid or "")
        for index, lost in _lost(job, observed).items()
        if lost.what is LostPart.CLAIM
    )


def unfinished(job: TrainingJob, observed: Observed) -> tuple[ReplicaObserved, ...]:
    """Return the replicas that have not ended according to the status; empty if the job has ended."""
    if job.status.phase in TERMINAL:
        return ()
    ended = {replica.index for replica in job.status.replicas if replica.phase in TERMINAL}
    return tuple(replica for replica in observed.replicas if replica.index not in ended)


def worlds_are_checked(job: TrainingJob, observed: Observed) -> Hold | None:
    """The worlds do not wait for a check; a namespace's large worlds are checked one after the other."""
    del job
    return held(Reason.CHECKING_WORLDS) if observed.worlds_wait else None


def no_queue_without_kueue(job: TrainingJob, observed: Observed) -> Hold | None:
    """Without Kueue, a job with a queue would wait forever."""
    if job.spec.scheduling.queue_name is None or observed.kueue:
        return None
    return held(Reason.NO_KUEUE)


def sources_are_there(job: TrainingJob, observed: Observed) -> Hold | None:
    """Each object that the spec names exists."""
    return next((found for reference in references(job) if (found := _missing(reference, observed))), None)


def sources_are_for_jobs(job: TrainingJob, observed: Observed) -> Hold | None:
    """A TrainingJob must not give its author access to objects that the author has no permission to read."""
    return next((found for reference in references(job) if (found := _closed(reference, observed))), None)


def sources_are_still_for_jobs(job: TrainingJob, observed: Observed) -> Hold | None:
    """A resumed Job creates a new pod, so the objects that it uses must still be for jobs.

    A ConfigMap of a world may be missing, because the replica has a copy of the world.
    """
    for source in references(job):
        if (found := _missing(source, observed)) is not None:
            if source.kind is not ReferenceKind.CONFIG_MAP:
                return found
        elif (found := _closed(source, observed)) is not None:
            return found
    return None


def _missing(source: ReferencedObject, observed: Observed) -> Hold | None:
    if observed.sources.get(source) is not None:
        return None
    fact = f"{source.kind} {source.name} does not exist in this namespace"
    reason = _MISSING.get(source.kind, Reason.WORLD_MISSING)
    return held(reason, field=source.field, name=source.name, fact=fact, remedy=_CREATE)


def _closed(source: ReferencedObject, observed: Observed) -> Hold | None:
    if open_to_jobs(observed.sources.get(source)):
        return None
    return held(_NOT_FOR_JOBS[source.kind], field=source.field, name=source.name)


def worlds_have_their_keys(job: TrainingJob, observed: Observed) -> Hold | None:
    """Each ConfigMap of a world has the key that the spec names."""
    for field, name, key in _world_keys(job):
        if _world(observed, name, key) is None:
            fact = f"ConfigMap {name} has no key {key}"
            return held(Reason.WORLD_MISSING, field=field, fact=fact, remedy="add it")
    return None


HOLDS: tuple[Check, ...] = (
    worlds_are_checked,
    no_queue_without_kueue,
    sources_are_there,
    sources_are_for_jobs,
    worlds_have_their_keys,
)


def complete(job: TrainingJob, observed: Observed) -> bool:
    """Return whether each unfinished replica has its Job and the volumes of the Job's pods."""
    policy = any(kind == "NetworkPolicy" for kind, _ in observed.present)
    accepted = job.status.release is not None
    return not unfinished(job, observed) or (policy and accepted and not _lacking(job, observed))


def _lacking(job: TrainingJob, observed: Observed) -> tuple[int, ...]:
    """Return the unfinished replicas with a missing object, except replicas whose run is lost."""
    named = {source.name for source in references(job) if source.kind is ReferenceKind.CLAIM}
    there = {name for _, name in observed.present} | named
    lost = _lost(job, observed)
    return tuple(
        replica.index
        for replica in unfinished(job, observed)
        if replica.index not in lost and (replica.job is None or not replica.job.volumes <= there)
    )


def _lost(job: TrainingJob, observed: Observed) -> Mapping[int, LostRun]:
    return lost_runs(job, unfinished(job, observed), observed.present)


def resuming(job: TrainingJob, observed: Observed) -> bool:
    """Return whether the operator must resume a Job."""
    return any(to_resume(job, replica.job) for replica in unfinished(job, observed))


def _at_acceptance(job: TrainingJob, layout: ClusterLayout) -> ClusterLayout:
    release = job.status.release
    if release is None:
        return layout
    images = Images(
        trainer=release.trainer,
        stub=release.stub,
        mujoco=release.mujoco,
        webots=release.webots,
    )
    return replace(layout, images=images)


def _worlds(job: TrainingJob, observed: Observed) -> dict[tuple[str, str], bytes]:
    found = {(name, key): _world(observed, name, key) for _, name, key in _world_keys(job)}
    return {where: text.encode("utf-8", "replace") for where, text in found.items() if text is not None}


def _world_keys(job: TrainingJob) -> Iterator[tuple[str, str, str]]:
    for place, group in enumerate(job.spec.simulators):
        if (reference := group.world.config_map) is not None:
            yield f"spec.simulators[{place}].world.configMap.key", reference.name, reference.key


def _world(observed: Observed, name: str, key: str) -> str | None:
    raw = observed.sources.get(ReferencedObject(kind=ReferenceKind.CONFIG_MAP, name=name))
    text = part(raw, "data").get(key)
    return text if isinstance(text, str) else None
