"""Fixtures for several folders: a ROS master, and a real API server without nodes."""

import os
from collections.abc import Iterator

import pytest

from palaestra.cluster import Api, connect
from palaestra_trainer.webots.launching.master import ensure_master
from tests.control_plane import shared
from tests.control_plane.plane import ControlPlane
from tests.integration.operator.cluster import Place

RUN = shared.Run.of_this_process()  # created before pytest's workers, which inherit its environment


@pytest.fixture(scope="session")
def master() -> str:
    """Start the ROS master of this process, and return its URI.

    rospy can register only once, so each process has one master, which ends with the process.
    """
    os.environ["ROS_HOSTNAME"] = "localhost"
    os.environ["ROS_MASTER_URI"] = "http://localhost:1"
    ensure_master()
    return os.environ["ROS_MASTER_URI"]


@pytest.fixture(scope="session")
def control_plane(tmp_path_factory: pytest.TempPathFactory) -> ControlPlane:
    """Return the control plane of the whole run, with all objects of install.yaml except the Deployment.

    Each test uses its own namespace.
    """
    return shared.joined(RUN, tmp_path_factory.mktemp("clients"))


def pytest_unconfigure() -> None:
    """End the control plane after the run."""
    shared.end(RUN)


@pytest.fixture(scope="session")
def installed(control_plane: ControlPlane) -> Iterator[Api]:
    """Yield an administrator's client of the control plane."""
    api = connect(str(control_plane.kubeconfig))
    yield api
    api.close()


@pytest.fixture
def prefix() -> str:
    """Return the prefix for the names of namespaces."""
    return "place"


@pytest.fixture
def place(installed: Api, prefix: str) -> Place:
    """Return a new namespace for the test."""
    return Place(installed, prefix)
