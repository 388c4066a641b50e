"""What is kept of an object in a cache: what is read of it here, and nothing else.

Most of an object is its template and who wrote which field; two hundred jobs with their pods have to
fit into little memory. Observing what was trimmed shows the same as observing the whole.
"""

import json
from collections.abc import Mapping
from typing import Any

from palaestra.observe.jobs import REPLACED, SETTINGS, STOPPED, SUSPENDED
from palaestra.observe.shortening import shortened
from palaestra.plan.job import SUSPEND_SET

_METADATA = (
    "name", "namespace", "uid", "resourceVersion", "generation", "creationTimestamp",
    "deletionTimestamp", "deletionGracePeriodSeconds", "labels", "ownerReferences",
)  # fmt: skip
_CONTAINER = ("name", "image", "restartPolicy", "resources")
_POD_STATUS = (
    "phase", "reason", "message", "startTime", "podIP", "conditions",
    "initContainerStatuses", "containerStatuses",
)  # fmt: skip
_ANNOTATIONS = (STOPPED, REPLACED, SUSPENDED, SUSPEND_SET)

SIZE = "palaestra.dev/size"  # annotation of a cached TrainingJob: the bytes of the whole without its status
SMALL = 65_536  # bytes; one that is not larger is kept without it


def trimmed(raw: Mapping[str, Any]) -> dict[str, Any]:
    """Return an object as far as it is read while nothing of it is planned.

    Kinds that nobody here reads are returned whole, without the fields about their writers.
    """
    kind = raw.get("kind")
    kept = {name: raw[name] for name in ("apiVersion", "kind") if name in raw}
    kept["metadata"] = _metadata(raw)
    if kind == "Job":
        return kept | {"spec": _job_spec(raw), "status": raw.get("status", {})}
    if kind == "Pod":
        return kept | {"spec": _pod_spec(raw), "status": _some(raw.get("status"), _POD_STATUS)}
    if kind in {"ConfigMap", "PersistentVolumeClaim", "NetworkPolicy"}:
        return kept
    return _measured(raw, shortened(whole(raw))) if kind == "TrainingJob" else whole(raw)


def whole(raw: Mapping[str, Any]) -> dict[str, Any]:
    """Return an object with all that it holds, without the fields about its writers."""
    return {**raw, "metadata": _metadata(raw)}


def _measured(job: Mapping[str, Any], kept: dict[str, Any]) -> dict[str, Any]:
    """Return what is kept of a job; of a large one with its size, everybody's annotations included."""
    metadata = job.get("metadata")
    given = {**metadata, "managedFields": None} if isinstance(metadata, Mapping) else None
    size = len(json.dumps({**job, "metadata": given, "status": None}))
    if size <= SMALL:
        return kept
    annotations = {**kept["metadata"].get("annotations", {}), SIZE: str(size)}
    return {**kept, "metadata": {**kept["metadata"], "annotations": annotations}}


def _metadata(raw: Mapping[str, Any]) -> dict[str, Any]:
    metadata = raw.get("metadata")
    kept = _some(metadata, _METADATA)
    annotations = _some(metadata.get("annotations") if isinstance(metadata, Mapping) else None, _ANNOTATIONS)
    return kept | ({"annotations": annotations} if annotations else {})


def _job_spec(raw: Mapping[str, Any]) -> dict[str, Any]:
    spec = raw.get("spec")
    kept = _some(spec, ("suspend", *SETTINGS))
    template = spec.get("template") if isinstance(spec, Mapping) else None
    pod = template.get("spec") if isinstance(template, Mapping) else None
    volumes = pod.get("volumes") if isinstance(pod, Mapping) else None
    return kept | {"template": {"spec": {"volumes": volumes}}}


def _pod_spec(raw: Mapping[str, Any]) -> dict[str, Any]:
    spec = raw.get("spec")
    kept = _some(spec, ("nodeName",))
    volumes = spec.get("volumes") if isinstance(spec, Mapping) else None
    if isinstance(volumes, list):
        claims = [_some(each, ("persistentVolumeClaim",)) for each in volumes]
        kept["volumes"] = [each for each in claims if each]
    for field in ("initContainers", "containers"):
        items = spec.get(field) if isinstance(spec, Mapping) else None
        kept[field] = [_some(each, _CONTAINER) for each in items] if isinstance(items, list) else []
    return kept


def _some(raw: Any, names: tuple[str, ...]) -> dict[str, Any]:
    return {name: raw[name] for name in names if name in raw} if isinstance(raw, Mapping) else {}
