"""What the cluster shows of a TrainingJob: raw JSON in, checked values out.

Pure, and total: whatever an API server or a pod answers, there is an `Observed` and no exception. What
cannot be read is as if it were not there.

    objects = Objects(jobs=..., pods=..., sources={each: lookup(each) for each in references(job)}, ...)
    observed = observe(job, objects)
"""

from palaestra.observe.observing import observe
from palaestra.observe.sources import references
from palaestra.observe.trim import trimmed
from palaestra.observe.views import (
    ContainerKind,
    ContainerView,
    CreateFailure,
    Exit,
    JobEnd,
    JobView,
    Objects,
    Observed,
    Obstacle,
    PodView,
    Polled,
    Raw,
    ReplicaObserved,
    Source,
    SourceKind,
)

__all__ = [
    "ContainerKind",
    "ContainerView",
    "CreateFailure",
    "Exit",
    "JobEnd",
    "JobView",
    "Objects",
    "Observed",
    "Obstacle",
    "PodView",
    "Polled",
    "Raw",
    "ReplicaObserved",
    "Source",
    "SourceKind",
    "observe",
    "references",
    "trimmed",
]
