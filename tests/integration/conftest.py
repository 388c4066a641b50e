"""What several folders here need: a real ROS master, and a real API server without nodes."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from palaestra.cluster import Api
from palaestra_trainer.launching.master import ensure_master
from tests.control_plane.installing import install
from tests.control_plane.plane import ControlPlane, running
from tests.integration.operator.cluster import Place

KINDS = Path(__file__).parents[2] / "manifests" / "crd.yaml"


@pytest.fixture(scope="session")
def master() -> str:
    """One master a process, since rospy registers once; it ends with the process."""
    os.environ["ROS_HOSTNAME"] = "localhost"
    os.environ["ROS_MASTER_URI"] = "http://localhost:1"
    ensure_master()
    return os.environ["ROS_MASTER_URI"]


@pytest.fixture(scope="session")
def control_plane(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ControlPlane]:
    """A control plane without nodes for all tests of a worker: each uses a namespace of its own.

    It knows TrainingJobs from the start.
    """
    with running(tmp_path_factory.mktemp("control-plane"), kinds=KINDS) as plane:
        yield plane


@pytest.fixture(scope="session")
def installed(control_plane: ControlPlane) -> Iterator[Api]:
    """An administrator's client, once everything of install.yaml but the Deployment is there."""
    api = install(control_plane)
    yield api
    api.close()


@pytest.fixture
def prefix() -> str:
    """How the name of the namespace begins."""
    return "place"


@pytest.fixture
def place(installed: Api, prefix: str) -> Place:
    """A namespace of the test's own."""
    return Place(installed, prefix)
