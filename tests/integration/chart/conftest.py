"""An API server that knows the kinds in the chart and the examples, and Helm to install with."""

import json
from collections.abc import Callable, Iterator

import pytest

from palaestra.cluster import Api, connect
from tests.chart.definitions import KUEUE, PROMETHEUS, definitions
from tests.chart.helm import NAMESPACE
from tests.control_plane.plane import ControlPlane, running
from tests.control_plane.programs import programs

DEFINITION = "trainingjobs.palaestra.dev"  # not deleted after tests that need no other object of Palaestra
NAMESPACES = (NAMESPACE, "robots", "drones")
# These projects have dozens of kinds, which are megabytes that an API server takes seconds to read.
KINDS = (
    (PROMETHEUS, "monitoring.coreos.com", ("podmonitors", "prometheusrules", "servicemonitors")),
    (KUEUE, "kueue.x-k8s.io", ("clusterqueues", "localqueues", "resourceflavors")),
)
Kubectl = Callable[..., str]


@pytest.fixture(scope="package")
def control_plane(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ControlPlane]:
    """Yield a control plane for this folder only.

    The tests delete definitions, and every TrainingJob with them.
    """
    with running(tmp_path_factory.mktemp("chart")) as plane:
        yield plane


@pytest.fixture(scope="package")
def kubectl(control_plane: ControlPlane) -> Kubectl:
    """Return a function that runs kubectl as the administrator and returns its output.

    The command must succeed.
    """

    def run(*arguments: str, sent: str = "") -> str:
        done = control_plane.kubectl(*arguments, sent=sent)
        assert done.returncode == 0, done.stderr
        return done.stdout + done.stderr

    return run


@pytest.fixture(scope="package")
def cluster(control_plane: ControlPlane, kubectl: Kubectl) -> ControlPlane:
    """Return the control plane with the kinds of Prometheus and Kueue in the chart and the examples."""
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
    """Make the namespaces of the modes.

    They refuse pods that are not restricted, and warn about the objects that create such pods.
    """
    labels = {f"pod-security.kubernetes.io/{each}": "restricted" for each in ("enforce", "warn")}
    for name in NAMESPACES:
        place = {"apiVersion": "v1", "kind": "Namespace", "metadata": {"name": name, "labels": labels}}
        kubectl("apply", "--server-side", "-f", "-", sent=json.dumps(place))


@pytest.fixture(scope="package")
def api(cluster: ControlPlane) -> Iterator[Api]:
    """Return a client of an administrator."""
    reached = connect(str(cluster.kubeconfig))
    yield reached
    reached.close()
