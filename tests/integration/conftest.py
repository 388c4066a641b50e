"""Fixtures for several folders: a real ROS master, and a real API server without nodes."""

import os
from collections.abc import Iterator

import pytest

from palaestra.cluster import Api, connect
from palaestra_trainer.webots.launching.master import ensure_master
from tests.control_plane import shared
from tests.control_plane.plane import ControlPlane
from tests.integration.operator.cluster import Place

RUN = shared.Run.of_this_process()  # the module is imported before the workers start


@pytest.fixture(scope="session")
def master() -> str:
    """Return the master of this process.

    rospy registers only once, so there is one master per process, and it ends with the process.
    """
    os.environ["ROS_HOSTNAME"] = "localhost"
    os.environ["ROS_MASTER_URI"] = "http://localhost:1"
    ensure_master()
    return os.environ["ROS_MASTER_URI"]


@pytest.fixture(scope="session")
def control_plane(tmp_path_factory: pytest.TempPathFactory) -> ControlPlane:
    """Return the control plane of the whole run; each test uses a separate namespace.

    Everything in install.yaml except the Deployment is installed.
    """
    return shared.joined(RUN, tmp_path_factory.mktemp("clients"))


def pytest_unconfigure() -> None:
    """End the control plane with the run."""
    shared.end(RUN)


@pytest.fixture(scope="session")
def installed(control_plane: ControlPlane) -> Iterator[Api]:
    """Yield a client of an administrator."""
    api = connect(str(control_plane.kubeconfig))
    yield api
    api.close()


@pytest.fixture
def prefix() -> str:
    """Return the prefix of the namespace's name."""
    return "place"


@pytest.fixture
def place(installed: Api, prefix: str) -> Place:
    """Return a new namespace for the test."""
    return Place(installed, prefix)
