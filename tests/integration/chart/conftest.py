"""An API server that knows the kinds which the chart and the examples use, and Helm to install with."""

import json
import os
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from palaestra.cluster import Api, connect
from tests.chart.helm import NAMESPACE
from tests.control_plane.fixture import control_plane
from tests.control_plane.plane import ControlPlane
from tests.control_plane.programs import REQUIRED, NoPrograms, programs

__all__ = ["control_plane"]

MODULES = {
    "github.com/prometheus-operator/prometheus-operator@v0.85.0": "example/prometheus-operator-crd",
    "sigs.k8s.io/kueue@v0.19.1": "config/components/crd/bases",
}
DEFINITION = "trainingjobs.palaestra.dev"  # left by tests that need no more of Palaestra
DOWNLOAD_S = 300
NAMESPACES = (NAMESPACE, "robots", "drones")
Kubectl = Callable[..., str]


def definitions(module: str, folder: str) -> Path:
    """Return the folder of a Go module that holds its CustomResourceDefinitions.

    Nothing is downloaded unless the tests are required to run.

    Raises:
        NoPrograms: Go, or the module, is not there.
    """
    proxy = {} if os.environ.get(REQUIRED) == "1" else {"GOPROXY": "off"}
    try:
        done = subprocess.run(
            ["go", "mod", "download", "-json", module],
            env={**os.environ, **proxy},
            capture_output=True,
            text=True,
            timeout=DOWNLOAD_S,
            check=False,
        )
    except FileNotFoundError as error:
        raise NoPrograms("Go is missing; install Go 1.26") from error
    answer = json.loads(done.stdout or "{}")
    if "Dir" not in answer:
        raise NoPrograms(f"{module} is not downloaded; get it with: go mod download {module}")
    return Path(answer["Dir"]) / folder


@pytest.fixture(scope="session")
def kubectl(control_plane: ControlPlane) -> Kubectl:
    """Run kubectl as the administrator, and return all that it says; it must succeed."""

    def run(*arguments: str, sent: str = "") -> str:
        done = control_plane.kubectl(*arguments, sent=sent)
        assert done.returncode == 0, done.stderr
        return done.stdout + done.stderr

    return run


@pytest.fixture(scope="session")
def cluster(control_plane: ControlPlane, kubectl: Kubectl) -> ControlPlane:
    """The control plane with Prometheus' and Kueue's kinds."""
    try:
        folders = [definitions(module, folder) for module, folder in MODULES.items()]
        programs(("helm",))
    except NoPrograms as error:
        if os.environ.get(REQUIRED) == "1":
            raise
        pytest.skip(str(error))
    for folder in folders:
        kubectl("apply", "--server-side", "-f", str(folder))
    return control_plane


@pytest.fixture
def places(cluster: ControlPlane, kubectl: Kubectl) -> None:  # noqa: ARG001 - is up by then
    """The namespaces of the modes, which refuse pods that are not restricted and warn of what makes them."""
    labels = {f"pod-security.kubernetes.io/{each}": "restricted" for each in ("enforce", "warn")}
    for name in NAMESPACES:
        place = {"apiVersion": "v1", "kind": "Namespace", "metadata": {"name": name, "labels": labels}}
        # A pod is refused while its account is missing, and a dry run makes none.
        tester = {"name": "palaestra-test", "namespace": name}
        account = {"apiVersion": "v1", "kind": "ServiceAccount", "metadata": tester}
        kubectl("apply", "--server-side", "-f", "-", sent="\n---\n".join(map(json.dumps, (place, account))))


@pytest.fixture(scope="session")
def api(cluster: ControlPlane) -> Iterator[Api]:
    """An administrator's client."""
    reached = connect(str(cluster.kubeconfig))
    yield reached
    reached.close()
