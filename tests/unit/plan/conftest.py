"""Builders of jobs and of their plans."""

from collections.abc import Callable
from typing import Any

import pytest

from palaestra.api import TrainingJob, validate
from palaestra.plan import ClusterLayout, Images, LocalLayout, Plan, Ports, identified, plan
from tests.jobs import make_job

UID = "0d1f3e5a-7c2b-4d68-9a40-c3b2a1908f7e"
IMAGES = Images(trainer="trainer:1", stub="stub:1", mujoco="mujoco:1", webots="webots:1")


@pytest.fixture
def valid_job() -> Callable[..., TrainingJob]:
    """Return a builder of jobs; its keywords are fields of the spec, in camelCase."""

    def make(name: str = "job", uid: str = UID, **spec: Any) -> TrainingJob:
        return identified(validate(make_job(name, **spec)), uid)

    return make


@pytest.fixture
def in_cluster(valid_job: Callable[..., TrainingJob]) -> Callable[..., Plan]:
    """Return a builder of cluster plans of jobs."""

    def make(**spec: Any) -> Plan:
        return plan(valid_job(**spec), ClusterLayout(images=IMAGES))

    return make


@pytest.fixture
def on_laptop(valid_job: Callable[..., TrainingJob]) -> Callable[..., Plan]:
    """Return a builder of local plans of jobs, with fixed ports."""

    def make(**spec: Any) -> Plan:
        ports = Ports(ros_master=4000, status=4001, control=(4100, 4101), health=(4200, 4201))
        layout = LocalLayout(images=IMAGES, job_directory="/runs/job", ports=ports)
        return plan(valid_job(**spec), layout)

    return make
