"""Plan what is missing, or say what keeps the job from being planned.

A job whose objects are all there is not planned at all: what its ConfigMaps of worlds say by now does
not matter to it any more, nor does a newer release.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from palaestra.api import TrainingJob
from palaestra.api.reasons import Reason, say
from palaestra.api.status import TERMINAL
from palaestra.decide.conditions import Told
from palaestra.observe.reading import part
from palaestra.observe.sources import open_to_jobs, references
from palaestra.observe.views import Observed, ReplicaObserved, Source, SourceKind
from palaestra.plan import ClusterLayout, Images, Plan, PlanError, plan
from palaestra_sim.errors import WorldError


@dataclass(frozen=True, slots=True, kw_only=True)
class Hold:
    """What keeps a job from being planned; `final`: nothing that anybody does can end it."""

    told: Told
    final: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Prepared:
    """The plan and the images that are in it, or why there is none; neither where nothing is missing."""

    plan: Plan | None = None
    images: Images | None = None
    hold: Hold | None = None


Check = Callable[[TrainingJob, Observed], Hold | None]

_NOT_FOR_JOBS = {
    SourceKind.CONFIG_MAP: Reason.CONFIG_MAP_NOT_FOR_JOBS,
    SourceKind.SECRET: Reason.SECRET_NOT_FOR_JOBS,
    SourceKind.CLAIM: Reason.CLAIM_NOT_FOR_JOBS,
}
_MISSING = {SourceKind.SECRET: Reason.SECRET_MISSING, SourceKind.CLAIM: Reason.CLAIM_MISSING}


def prepare(job: TrainingJob, observed: Observed, layout: ClusterLayout) -> Prepared:
    """Return the plan of a job of which something is missing, with the images that it was accepted with."""
    if complete(job, observed):
        return Prepared()
    if (hold := next((found for check in HOLDS if (found := check(job, observed))), None)) is not None:
        return Prepared(hold=hold)
    layout = _at_acceptance(job, layout)
    try:
        return Prepared(plan=plan(job, layout, _worlds(job, observed)), images=layout.images)
    except PlanError as error:
        return Prepared(hold=_hold(Reason.INVALID_SPEC, final=True, problem=error))
    except WorldError as error:
        mendable = any(group.world.config_map for group in job.spec.simulators)
        return Prepared(hold=_hold(Reason.WORLD_INVALID, final=not mendable, problem=error))


def unfinished(job: TrainingJob, observed: Observed) -> tuple[ReplicaObserved, ...]:
    """Return the replicas that the status does not call ended."""
    ended = {each.index for each in job.status.replicas if each.phase in TERMINAL}
    return tuple(each for each in observed.replicas if each.index not in ended)


def no_queue_without_kueue(job: TrainingJob, observed: Observed) -> Hold | None:
    """A queue that nobody serves would be waited for for ever."""
    if job.spec.scheduling.queue_name is None or observed.kueue:
        return None
    return _hold(Reason.NO_KUEUE)


def sources_are_there(job: TrainingJob, observed: Observed) -> Hold | None:
    """Everything that the spec names exists."""
    for source in references(job):
        if observed.sources.get(source) is None:
            fact = f"there is no {source.kind} {source.name} here"
            reason = _MISSING.get(source.kind, Reason.WORLD_MISSING)
            return _hold(reason, field=source.field, name=source.name, fact=fact)
    return None


def sources_are_for_jobs(job: TrainingJob, observed: Observed) -> Hold | None:
    """Whoever writes a TrainingJob must not open what they could not open before."""
    for source in references(job):
        if not open_to_jobs(observed.sources.get(source)):
            return _hold(_NOT_FOR_JOBS[source.kind], field=source.field, name=source.name)
    return None


def worlds_have_their_keys(job: TrainingJob, observed: Observed) -> Hold | None:
    """A ConfigMap without the key is as good as none."""
    for field, name, key in _world_keys(job):
        if _world(observed, name, key) is None:
            return _hold(Reason.WORLD_MISSING, field=field, fact=f"ConfigMap {name} has no key {key}")
    return None


HOLDS: tuple[Check, ...] = (
    no_queue_without_kueue,
    sources_are_there,
    sources_are_for_jobs,
    worlds_have_their_keys,
)


def _hold(reason: Reason, *, final: bool = False, **facts: object) -> Hold:
    return Hold(told=Told(reason=reason, message=say(reason, **facts)), final=final)


def complete(job: TrainingJob, observed: Observed) -> bool:
    """Return whether every replica that goes on has its Job, and what the Job's pods mount is there."""
    there = {name for _, name in observed.present}
    borrowed = job.spec.storage.existing_claim
    policy = any(kind == "NetworkPolicy" for kind, _ in observed.present)
    going_on = unfinished(job, observed)
    return not going_on or (
        policy
        and job.status.release is not None
        and all(each.job is not None and each.job.volumes - {borrowed} <= there for each in going_on)
    )


def _at_acceptance(job: TrainingJob, layout: ClusterLayout) -> ClusterLayout:
    release = job.status.release
    if release is None:
        return layout
    return replace(layout, images=Images(trainer=release.trainer, stub=release.stub, webots=release.webots))


def _worlds(job: TrainingJob, observed: Observed) -> dict[tuple[str, str], bytes]:
    found = {(name, key): _world(observed, name, key) for _, name, key in _world_keys(job)}
    return {where: text.encode("utf-8", "replace") for where, text in found.items() if text is not None}


def _world_keys(job: TrainingJob) -> Iterator[tuple[str, str, str]]:
    for place, group in enumerate(job.spec.simulators):
        if (reference := group.world.config_map) is not None:
            yield f"spec.simulators[{place}].world.configMap.key", reference.name, reference.key


def _world(observed: Observed, name: str, key: str) -> str | None:
    raw = observed.sources.get(Source(kind=SourceKind.CONFIG_MAP, name=name))
    text = part(raw, "data").get(key)
    return text if isinstance(text, str) else None
