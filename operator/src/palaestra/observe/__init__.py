"""Convert the raw JSON of a TrainingJob's objects into checked values, the observation.

`observe` is pure and total: it returns an `Observed` for any response of an API server or a pod, and raises
no exception. An unreadable value counts as absent.

    observed = observe(job, Objects(jobs=..., pods=..., ...))
    if not complete(job, observed):  # of palaestra.decide
        observed = replace(observed, sources={each: lookup(each) for each in references(job)}, kueue=...)
"""

from palaestra.observe.cache_trim import trimmed, whole
from palaestra.observe.cached_job import Lacking, lacking
from palaestra.observe.kueue import why_not_admitted
from palaestra.observe.models import (
    ContainerExit,
    ContainerKind,
    ContainerView,
    CreateFailure,
    ForeignJob,
    JobEnd,
    JobView,
    Objects,
    Observed,
    PodView,
    Polled,
    Raw,
    ReferencedObject,
    ReferenceKind,
    Replaced,
    ReplicaObserved,
    Suspended,
)
from palaestra.observe.observe import last_blocking_event, observe
from palaestra.observe.pods import was_signalled
from palaestra.observe.references import references

__all__ = [
    "ContainerExit",
    "ContainerKind",
    "ContainerView",
    "CreateFailure",
    "ForeignJob",
    "JobEnd",
    "JobView",
    "Lacking",
    "Objects",
    "Observed",
    "PodView",
    "Polled",
    "Raw",
    "ReferenceKind",
    "ReferencedObject",
    "Replaced",
    "ReplicaObserved",
    "Suspended",
    "lacking",
    "last_blocking_event",
    "observe",
    "references",
    "trimmed",
    "was_signalled",
    "whole",
    "why_not_admitted",
]
