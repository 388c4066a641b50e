"""The cached copy of a TrainingJob; the copy is small whatever the content of the job's fields.

Only the plan needs the removed fields, so for a plan the operator reads the object from the API server. An
annotation on the copy names the removed fields, so that the copy itself is never planned. Users cannot set
this annotation, because the object's other annotations are not copied.
"""

import hashlib
import json
from collections.abc import Collection, Mapping
from enum import StrEnum
from typing import Any

from palaestra.observe.json_access import part, parts

LACKS = "palaestra.dev/lacks"  # annotation of a cached copy: the value of `Lacking`
LONGEST_TEXT = 256  # characters; a longer inline world is replaced by its digest
MOST_CHARACTERS = 32_768  # limit of a cached copy without its status; a usual job has 4,000 characters

# These fields may be large, because they contain lists and maps of texts. Once the job's objects exist, no
# decision needs these fields.
_LARGE_OF_SPEC = frozenset({"imagePullSecrets", "rosMaster"})
_LARGE_OF_TRAINER = frozenset({"algorithm", "command", "env", "environment", "resources"})
_LARGE_OF_GROUP = frozenset({"command", "driver", "env", "image", "options", "resources", "world"})
_LARGE_OF_SCHEDULING = frozenset({"affinity", "nodeSelector", "podAnnotations", "podLabels", "tolerations"})
_LARGE_OF_METADATA = frozenset({"labels", "ownerReferences"})


class Lacking(StrEnum):
    """The fields that a cached copy lacks."""

    TEXTS = "texts"
    """The texts of the inline worlds, which digests replace."""

    FIELDS = "fields"
    """All fields that may be large, including references to other objects."""


def shortened(job: Mapping[str, Any]) -> dict[str, Any]:
    """Return a TrainingJob with digests of its worlds; if it is still large, remove its large fields too.

    The result is a valid TrainingJob if the whole TrainingJob is valid.
    """
    kept = {**job, "spec": _with_digests(part(job, "spec"))}
    lacking = None if kept["spec"] == job.get("spec") else Lacking.TEXTS
    if len(json.dumps({**kept, "status": None})) > MOST_CHARACTERS:
        lacking = Lacking.FIELDS
        metadata = _without(part(job, "metadata"), _LARGE_OF_METADATA)
        kept = {**job, "metadata": metadata, "spec": _without_large(kept["spec"])}
    return kept if lacking is None else _marked(kept, lacking)


def lacking(job: Mapping[str, Any]) -> Lacking | None:
    """Return the value of `Lacking` for a cached copy; None if the copy is whole."""
    mark = part(job, "metadata", "annotations").get(LACKS)
    return Lacking(mark) if mark in tuple(Lacking) else None


def digest(text: str) -> str:
    """Return the digest of a long text: its SHA-256 and its length."""
    return f"sha256:{hashlib.sha256(text.encode()).hexdigest()}, {len(text)} characters"


def _marked(job: dict[str, Any], lacking: Lacking) -> dict[str, Any]:
    metadata = part(job, "metadata")
    annotations = part(metadata, "annotations") | {LACKS: lacking.value}
    return {**job, "metadata": {**metadata, "annotations": annotations}}


def _with_digests(spec: dict[str, Any]) -> dict[str, Any]:
    if not isinstance(spec.get("simulators"), list):
        return spec
    return {**spec, "simulators": [_with_digest(group) for group in parts(spec, "simulators")]}


def _with_digest(group: dict[str, Any]) -> dict[str, Any]:
    text = part(group, "world").get("inline")
    if not isinstance(text, str) or len(text) <= LONGEST_TEXT:
        return group
    return {**group, "world": {**group["world"], "inline": digest(text)}}


def _without_large(spec: dict[str, Any]) -> dict[str, Any]:
    kept = _without(spec, _LARGE_OF_SPEC)
    for field, large in (("trainer", _LARGE_OF_TRAINER), ("scheduling", _LARGE_OF_SCHEDULING)):
        if field in kept:
            kept[field] = _without(part(kept, field), large)
    if "simulators" in kept:
        kept["simulators"] = [_without(group, _LARGE_OF_GROUP) for group in parts(kept, "simulators")]
    return kept


def _without(raw: Mapping[str, Any], names: Collection[str]) -> dict[str, Any]:
    return {name: value for name, value in raw.items() if name not in names}
