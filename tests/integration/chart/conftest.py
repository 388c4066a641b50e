"""An API server that knows the kinds which the chart and the examples use, and Helm to install with."""

import json
from collections.abc import Callable, Iterator

import pytest

from palaestra.cluster import Api, connect
from tests.chart.definitions import KUEUE, PROMETHEUS, definitions
from tests.chart.helm import NAMESPACE
from tests.control_plane.plane import ControlPlane, running
from tests.control_plane.programs import programs

DEFINITION = "trainingjobs.palaestra.dev"  # left by tests that need no more of Palaestra
NAMESPACES = (NAMESPACE, "robots", "drones")
# Of dozens that these projects have, which are megabytes that an API server takes seconds to read.
KINDS = (
    (PROMETHEUS, "monitoring.coreos.com", ("podmonitors", "prometheusrules", "servicemonitors")),
    (KUEUE, "kueue.x-k8s.io", ("clusterqueues", "localqueues", "resourceflavors")),
)
Kubectl = Callable[..., str]


@pytest.fixture(scope="package")
def control_plane(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ControlPlane]:
    """One that only this folder uses: definitions are deleted here, and every TrainingJob with them."""
    with running(tmp_path_factory.mktemp("chart")) as plane:
        yield plane


@pytest.fixture(scope="package")
def kubectl(control_plane: ControlPlane) -> Kubectl:
    """Run kubectl as the administrator, and return all that it says; it must succeed."""

    def run(*arguments: str, sent: str = "") -> str:
        done = control_plane.kubectl(*arguments, sent=sent)
        assert done.returncode == 0, done.stderr
        return done.stdout + done.stderr

    return run


@pytest.fixture(scope="package")
def cluster(control_plane: ControlPlane, kubectl: Kubectl) -> ControlPlane:
    """The control plane with those of Prometheus' and Kueue's kinds that the chart and the examples use."""
    files = [
        f"--filename={definitions(*module)}/{group}_{kind}.yaml"
        for module, group, kinds in KINDS
        for kind in kinds
    ]
    programs(("helm",))
    kubectl("apply", "--server-side", *files)
    control_plane.await_kinds(*files)
    return control_plane


@pytest.fixture
def places(cluster: ControlPlane, kubectl: Kubectl) -> None:  # noqa: ARG001 - is up by then
    """The namespaces of the modes, which refuse pods that are not restricted and warn of what makes them."""
    labels = {f"pod-security.kubernetes.io/{each}": "restricted" for each in ("enforce", "warn")}
    for name in NAMESPACES:
        place = {"apiVersion": "v1", "kind": "Namespace", "metadata": {"name": name, "labels": labels}}
        kubectl("apply", "--server-side", "-f", "-", sent=json.dumps(place))


@pytest.fixture(scope="package")
def api(cluster: ControlPlane) -> Iterator[Api]:
    """An administrator's client."""
    reached = connect(str(cluster.kubeconfig))
    yield reached
    reached.close()
