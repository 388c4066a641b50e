"""What is kept of an object in a cache: what is read of it here, and nothing else.

Most of an object is its template and who wrote which field; two hundred jobs with their pods have to
fit into little memory. Observing what was trimmed shows the same as observing the whole.
"""

from collections.abc import Mapping
from typing import Any

_METADATA = (
    "name", "namespace", "uid", "resourceVersion", "generation", "creationTimestamp",
    "deletionTimestamp", "labels", "ownerReferences",
)  # fmt: skip
_CONTAINER = ("name", "image", "restartPolicy", "resources")
_POD_STATUS = (
    "phase", "reason", "message", "startTime", "podIP", "conditions",
    "initContainerStatuses", "containerStatuses",
)  # fmt: skip
_ANNOTATIONS = ("palaestra.dev/stopped",)


def trimmed(raw: Mapping[str, Any]) -> dict[str, Any]:
    """Return a Job, pod, ConfigMap, claim, NetworkPolicy or event as far as it is read.

    Any other kind is returned whole, without what is told of its writers.
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
    return {**raw, "metadata": kept["metadata"]}


def _metadata(raw: Mapping[str, Any]) -> dict[str, Any]:
    metadata = raw.get("metadata")
    kept = _some(metadata, _METADATA)
    annotations = _some(metadata.get("annotations") if isinstance(metadata, Mapping) else None, _ANNOTATIONS)
    return kept | ({"annotations": annotations} if annotations else {})


def _job_spec(raw: Mapping[str, Any]) -> dict[str, Any]:
    spec = raw.get("spec")
    kept = _some(spec, ("suspend",))
    template = spec.get("template") if isinstance(spec, Mapping) else None
    pod = template.get("spec") if isinstance(template, Mapping) else None
    volumes = pod.get("volumes") if isinstance(pod, Mapping) else None
    return kept | {"template": {"spec": {"volumes": volumes}}}


def _pod_spec(raw: Mapping[str, Any]) -> dict[str, Any]:
    spec = raw.get("spec")
    kept = _some(spec, ("nodeName",))
    for field in ("initContainers", "containers"):
        items = spec.get(field) if isinstance(spec, Mapping) else None
        kept[field] = [_some(each, _CONTAINER) for each in items] if isinstance(items, list) else []
    return kept


def _some(raw: Any, names: tuple[str, ...]) -> dict[str, Any]:
    return {name: raw[name] for name in names if name in raw} if isinstance(raw, Mapping) else {}
