"""Trim an object for a cache to the fields that `observe` reads.

The pod template and the managedFields are most of an object's size. Without them, two hundred jobs with their
pods fit into little memory. The observation of trimmed objects equals the observation of whole objects.
"""

import json
from collections.abc import Mapping
from typing import Any

from palaestra.observe.cached_job import shortened
from palaestra.observe.claims import FIELDS
from palaestra.observe.jobs import REPLACED, SETTINGS, STOPPED, SUSPENDED
from palaestra.plan.job import SUSPEND_SET
from palaestra.plan.replica import RESTART_LOST_RUNS

_METADATA = (
    "name", "namespace", "uid", "resourceVersion", "generation", "creationTimestamp",
    "deletionTimestamp", "deletionGracePeriodSeconds", "labels", "ownerReferences",
)  # fmt: skip
_CONTAINER = ("name", "image", "restartPolicy", "resources")
_POD_STATUS = (
    "phase", "reason", "message", "startTime", "podIP", "conditions",
    "initContainerStatuses", "containerStatuses",
)  # fmt: skip
_ANNOTATIONS = (STOPPED, REPLACED, SUSPENDED, SUSPEND_SET, RESTART_LOST_RUNS)

# Annotation of a cached TrainingJob: the size of the whole job without its status, in bytes.
SIZE = "palaestra.dev/size"
SMALL = 65_536  # bytes; a cached TrainingJob of at most this size does not get the annotation


def trimmed(raw: Mapping[str, Any]) -> dict[str, Any]:
    """Return a copy of an object with the fields that the operator needs, except fields for a plan only.

    An object of an unknown kind keeps all fields except managedFields.
    """
    kind = raw.get("kind")
    kept = {name: raw[name] for name in ("apiVersion", "kind") if name in raw}
    kept["metadata"] = _metadata(raw)
    if kind == "Job":
        return kept | {"spec": _job_spec(raw), "status": raw.get("status", {})}
    if kind == "Pod":
        return kept | {"spec": _pod_spec(raw), "status": _some(raw.get("status"), _POD_STATUS)}
    if kind == "PersistentVolumeClaim":
        return kept | {"spec": _some(raw.get("spec"), FIELDS), "status": _some(raw.get("status"), ("phase",))}
    if kind in {"ConfigMap", "NetworkPolicy"}:
        return kept
    return _measured(raw, shortened(whole(raw))) if kind == "TrainingJob" else whole(raw)


def whole(raw: Mapping[str, Any]) -> dict[str, Any]:
    """Return an object with all fields except managedFields."""
    return {**raw, "metadata": _metadata(raw)}


def _measured(job: Mapping[str, Any], kept: dict[str, Any]) -> dict[str, Any]:
    """Return the trimmed job; a large job gets an annotation with the size of the untrimmed job."""
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
        claims = [_some(volume, ("persistentVolumeClaim",)) for volume in volumes]
        kept["volumes"] = [claim for claim in claims if claim]
    for field in ("initContainers", "containers"):
        items = spec.get(field) if isinstance(spec, Mapping) else None
        kept[field] = [_some(item, _CONTAINER) for item in items] if isinstance(items, list) else []
    return kept


def _some(raw: Any, names: tuple[str, ...]) -> dict[str, Any]:
    return {name: raw[name] for name in names if name in raw} if isinstance(raw, Mapping) else {}
