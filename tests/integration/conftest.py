"""What several folders here need: a real ROS master, and a real API server without nodes."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from palaestra.cluster import Api, Resource, connect
from palaestra_trainer.simulators.master import ensure_master
from tests.chart.installation import installed as installation
from tests.control_plane.plane import ControlPlane, running
from tests.integration.operator.cluster import Place, served
from tests.waiting import eventually

KINDS = Path(__file__).parents[2] / "manifests" / "crd.yaml"
UNNAMESPACED = {"Namespace", "ClusterRole", "ClusterRoleBinding"}
PLURALS = {"NetworkPolicy": "networkpolicies"}


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
    api = connect(str(control_plane.kubeconfig))
    for obj in installation():
        if obj["kind"] not in {"Deployment", "CustomResourceDefinition"}:
            kind = obj["kind"]
            resource = Resource(
                api_version=obj["apiVersion"],
                kind=kind,
                plural=PLURALS.get(kind, f"{kind.lower()}s"),
                namespaced=kind not in UNNAMESPACED,
            )
            api.create(resource, obj)
    eventually(lambda: served(api))
    yield api
    api.close()


@pytest.fixture
def place(installed: Api) -> Place:
    """A namespace of the test's own."""
    return Place(installed)
