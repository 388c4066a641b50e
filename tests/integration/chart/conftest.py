"""Fixtures: an API server with all kinds of the chart and the examples, and Helm."""

import json
from collections.abc import Callable, Iterator

import pytest

from palaestra.cluster import Api, connect
from tests.chart.definitions import KUEUE, PROMETHEUS, definitions
from tests.chart.helm import NAMESPACE
from tests.control_plane.plane import ControlPlane, running
from tests.control_plane.programs import programs

DEFINITION = "trainingjobs.palaestra.dev"  # a test deletes the definition first, and so all TrainingJobs
NAMESPACES = (NAMESPACE, "robots", "drones")
# Only these kinds are installed, because the projects have dozens, which an API server needs seconds to read.
KINDS = (
    (PROMETHEUS, "monitoring.coreos.com", ("podmonitors", "prometheusrules", "servicemonitors")),
    (KUEUE, "kueue.x-k8s.io", ("clusterqueues", "localqueues", "resourceflavors")),
)
Kubectl = Callable[..., str]


@pytest.fixture(scope="package")
def control_plane(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ControlPlane]:
    """Yield a control plane that only this folder uses.

    Its tests delete the definition and thereby every TrainingJob, which would disturb all other tests.
    """
    with running(tmp_path_factory.mktemp("chart")) as plane:
        yield plane


@pytest.fixture(scope="package")
def kubectl(control_plane: ControlPlane) -> Kubectl:
    """Return a function that runs kubectl as the administrator and returns the output.

    The function raises an error if the command fails.
    """

    def run(*arguments: str, sent: str = "") -> str:
        done = control_plane.kubectl(*arguments, sent=sent)
        assert done.returncode == 0, done.stderr
        return done.stdout + done.stderr

    return run


@pytest.fixture(scope="package")
def cluster(control_plane: ControlPlane, kubectl: Kubectl) -> ControlPlane:
    """Return the control plane after it has the kinds of Prometheus and Kueue."""
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
def places(cluster: ControlPlane, kubectl: Kubectl) -> None:  # noqa: ARG001 - it must run
    """Create the namespaces of all modes.

    They refuse pods that violate *restricted*, and warn about objects that create such pods.
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
