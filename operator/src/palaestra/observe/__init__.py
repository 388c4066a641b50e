"""The observation of a TrainingJob in a cluster: raw JSON in, checked values out.

Pure and total: for any answer of an API server or a pod it returns an `Observed` and raises nothing. A value
that cannot be read counts as absent.

    observed = observe(job, Objects(jobs=..., pods=..., ...))
    if not complete(job, observed):  # of palaestra.decide
        observed = replace(observed, sources={each: lookup(each) for each in references(job)}, kueue=...)
"""

from palaestra.observe.observing import last_hindrance, observe
from palaestra.observe.pods import was_signalled
from palaestra.observe.shortening import Lacking, lacking
from palaestra.observe.sources import references
from palaestra.observe.trim import trimmed, whole
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
    Replaced,
    ReplicaObserved,
    Source,
    SourceKind,
    Suspended,
)
from palaestra.observe.workloads import why_not_admitted

__all__ = [
    "ContainerKind",
    "ContainerView",
    "CreateFailure",
    "Exit",
    "JobEnd",
    "JobView",
    "Lacking",
    "Objects",
    "Observed",
    "Obstacle",
    "PodView",
    "Polled",
    "Raw",
    "Replaced",
    "ReplicaObserved",
    "Source",
    "SourceKind",
    "Suspended",
    "lacking",
    "last_hindrance",
    "observe",
    "references",
    "trimmed",
    "was_signalled",
    "whole",
    "why_not_admitted",
]
