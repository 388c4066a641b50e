"""The events about a TrainingJob and about the objects created for it, oldest first."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from palaestra.api import TrainingJob
from palaestra.api.job import KIND
from palaestra.cluster import Api
from palaestra.cluster.resources import EVENTS
from palaestra.plan.claim import claim_name

MADE_FOR_REPLICAS = {"Job", "Pod", "PersistentVolumeClaim", "ConfigMap"}

CONTAINER = re.compile(r"spec\.\w*[cC]ontainers\{(.+)\}")  # matches init and ephemeral containers too


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """One event.

    Attributes:
        time: the time of the last occurrence.
        warning: whether its type is Warning.
        about: kind and name of the object: `Pod/job-0-x7k2p`.
        reason: one word; docs/reference/reasons.md explains the reasons of events about the TrainingJob.
        message: one sentence.
        count: number of occurrences.
        container: the container of the pod in `about`; empty: the event is about the whole pod or another
            object.
    """

    time: datetime
    warning: bool
    about: str
    reason: str
    message: str
    count: int
    container: str = ""


def events_about(api: Api, job: TrainingJob) -> tuple[Event, ...]:
    """Return the events of a job; by default Kubernetes deletes events after an hour.

    Raises:
        ApiError: the API server refuses.
    """
    events = api.list(EVENTS, job.metadata.namespace)
    return tuple(
        sorted((_read(event) for event in events if concerns(event, job)), key=lambda event: event.time)
    )


def concerns(event: Mapping[str, Any], job: TrainingJob) -> bool:
    """Return whether an event is about this job, or about a Job, pod, ConfigMap or claim of its replicas."""
    about = event["involvedObject"]
    kind, name, uid = about.get("kind"), about.get("name", ""), about.get("uid")
    if kind == KIND:
        return name == job.metadata.name and uid in {None, job.metadata.uid}
    # A pod has the name of its Job, with five more characters at the end. The name of a ConfigMap ends in ten
    # hexadecimal digits. The names of most claims end in the job's uid.
    ending = rf"[a-z0-9]{{5}}|[0-9a-f]{{10}}|{re.escape(job.metadata.uid or '')}"
    replica = rf"{re.escape(job.metadata.name)}-[0-9]+(-({ending}))?"
    claims = (
        claim_name(job.metadata.name, index, job.metadata.uid or "") for index in range(job.spec.replicas)
    )
    return kind in MADE_FOR_REPLICAS and (re.fullmatch(replica, name) is not None or name in claims)


def _read(event: Mapping[str, Any]) -> Event:
    about = event["involvedObject"]
    times = (event.get("lastTimestamp"), event.get("eventTime"), event["metadata"]["creationTimestamp"])
    return Event(
        time=datetime.fromisoformat(next(time for time in times if time)),
        warning=event.get("type") == "Warning",
        about=f"{about.get('kind')}/{about.get('name')}",
        reason=str(event.get("reason") or ""),
        message=str(event.get("message") or ""),
        count=int(event.get("count") or 1),
        container=_container(str(about.get("fieldPath") or "")),
    )


def _container(field_path: str) -> str:
    """Return the container's name in a path such as `spec.initContainers{ros-master}`, or ""."""
    found = CONTAINER.fullmatch(field_path)
    return found[1] if found else ""
