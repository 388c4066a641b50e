"""The builder of TrainingJobs as data. A test passes only the fields that it needs."""

import copy
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

EXAMPLES = Path(__file__).parents[1] / "manifests" / "examples"

Object = dict[str, Any]


def make_job(
    name: str = "job", *, metadata: Mapping[str, Any] | None = None, status: Object | None = None, **spec: Any
) -> Object:
    """Return a TrainingJob; keywords are fields of its spec, in camelCase."""
    job: Object = {
        "apiVersion": "palaestra.dev/v1alpha1",
        "kind": "TrainingJob",
        "metadata": {"name": name, **(metadata or {})},
        "spec": copy.deepcopy(spec),
    }
    return job if status is None else {**job, "status": status}


def example(name: str) -> Object:
    """Return a TrainingJob of manifests/examples."""
    job: Object = yaml.safe_load((EXAMPLES / f"{name}.yaml").read_text())
    return job


def changed(job: Object, path: str, value: Any) -> Object:
    """Return a copy of a job with another value at a path such as `spec.simulators.0.count`."""
    whole = copy.deepcopy(job)
    *above, last = path.split(".")
    inside: Any = whole
    for step in above:
        inside = inside[int(step)] if isinstance(inside, list) else inside.setdefault(step, {})
    inside[int(last) if isinstance(inside, list) else last] = value
    return whole
