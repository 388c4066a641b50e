"""A control plane with the installation in it, a namespace for each test, and operators to start."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from palaestra.cluster import Api, NotFound, Resource, connect
from palaestra.cluster.resources import LEASES, TRAINING_JOBS
from palaestra.operator.options import DEFAULT_NAMESPACE as NAMESPACE
from palaestra.operator.options import NAME
from tests.chart.installation import installed as installation
from tests.control_plane.fixture import control_plane
from tests.control_plane.plane import ControlPlane
from tests.integration.operator.cluster import Place, eventually
from tests.integration.operator.operators import RunningOperator

__all__ = ["control_plane"]

Start = Callable[..., RunningOperator]
UNNAMESPACED = {"Namespace", "CustomResourceDefinition", "ClusterRole", "ClusterRoleBinding"}
PLURALS = {"NetworkPolicy": "networkpolicies"}


@pytest.fixture(scope="session")
def installed(control_plane: ControlPlane) -> Iterator[Api]:
    """An administrator's client, once everything of install.yaml but the Deployment is there."""
    api = connect(str(control_plane.kubeconfig))
    for obj in installation():
        if obj["kind"] != "Deployment":
            kind = obj["kind"]
            resource = Resource(
                api_version=obj["apiVersion"],
                kind=kind,
                plural=PLURALS.get(kind, f"{kind.lower()}s"),
                namespaced=kind not in UNNAMESPACED,
            )
            api.create(resource, obj)
    eventually(lambda: _served(api))
    yield api
    api.close()


@pytest.fixture
def place(installed: Api) -> Place:
    """A namespace of the test's own."""
    return Place(installed)


@pytest.fixture
def start(control_plane: ControlPlane, installed: Api, place: Place, tmp_path: Path) -> Iterator[Start]:
    """A function that starts operators with the rights of an installation, for this namespace only.

    Without election, unless a test asks for it: the tests share one Lease.
    """
    user = f"system:serviceaccount:{NAMESPACE}:{NAME}"
    kubeconfig = control_plane.kubeconfig_of(user, "system:serviceaccounts")
    started: list[RunningOperator] = []

    def begin(*options: str, elect: bool = False, dies_after: int | None = None) -> RunningOperator:
        election = "--leader-elect" if elect else "--no-leader-elect"
        if not started:  # what an earlier test left of the Lease would have to run out
            with suppress(NotFound):
                installed.delete(LEASES, NAMESPACE, NAME)
        log = tmp_path / f"operator-{len(started)}.log"
        common = (f"--namespace={place.name}", election, *options)
        started.append(RunningOperator(kubeconfig, log, *common, dies_after=dies_after))
        return started[-1]

    yield begin
    for each in started:
        each.kill()


def _served(api: Api) -> bool:
    try:
        api.list(TRAINING_JOBS)
    except NotFound:
        return False
    return True
