"""A job and the raw objects of its only replica, as an API server stores them."""

from collections.abc import Callable
from copy import deepcopy
from typing import Any

import pytest

from palaestra.api import TrainingJob, validate
from palaestra.observe import Objects, Observed, observe
from palaestra.plan import ClusterLayout, Images, plan
from tests.jobs import make_job

UID = "0d1f3e5a-7c2b-4d68-9a40-c3b2a1908f7e"


def _valid_job(**spec: Any) -> TrainingJob:
    return validate(make_job(metadata={"uid": UID}, **spec))


@pytest.fixture
def valid_job() -> Callable[..., TrainingJob]:
    """Return a function that builds a job; its keywords are fields of the spec, in camelCase."""
    return _valid_job


@pytest.fixture
def raw_job() -> dict[str, Any]:
    """Return the Kubernetes Job (batch/v1) of the replica."""
    planned = plan(_valid_job(), ClusterLayout(images=Images.of_release("1")))
    job = deepcopy(dict(planned.replicas[0].job))
    job["metadata"]["uid"] = "job-uid"
    return job


@pytest.fixture
def raw_pod(raw_job: dict[str, Any]) -> dict[str, Any]:
    """Return a pod of the replica that has not started yet."""
    template = deepcopy(raw_job["spec"]["template"])
    named: dict[str, Any] = {"name": "job-0-x", "uid": "pod-1", "creationTimestamp": "2026-01-31T12:00:00Z"}
    named["ownerReferences"] = [{"kind": "Job", "uid": raw_job["metadata"]["uid"]}]
    return {"kind": "Pod", **template, "metadata": {**template["metadata"], **named}, "status": {}}


@pytest.fixture
def look(raw_job: dict[str, Any]) -> Callable[..., Observed]:
    """`look(pods=[...])` returns the observation of the job.

    Its Kubernetes Job exists unless `jobs` replaces it.
    """
    return lambda **objects: observe(_valid_job(), Objects(**({"jobs": [raw_job]} | objects)))
