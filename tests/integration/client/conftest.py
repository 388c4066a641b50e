"""Clients of a namespace in a real control plane, and of a server whose responses a test prepares."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from palaestra import Client
from palaestra.cli import main
from palaestra.cluster.resources import TRAINING_JOBS
from tests.control_plane.plane import ControlPlane
from tests.integration.apiserver.server import Script, serving
from tests.integration.operator.cluster import Place


@pytest.fixture
def client(control_plane: ControlPlane, place: Place) -> Iterator[Client]:
    """Return a client of the test's namespace."""
    with Client(namespace=place.name, kubeconfig=str(control_plane.kubeconfig)) as made:
        yield made


@pytest.fixture
def typed(
    control_plane: ControlPlane, place: Place, capsys: pytest.CaptureFixture[str]
) -> Callable[..., tuple[int, list[str], list[str]]]:
    """Return a function that runs a command, and returns exit code and lines of both outputs."""

    def run(*arguments: str) -> tuple[int, list[str], list[str]]:
        where = [f"--kubeconfig={control_plane.kubeconfig}", f"--namespace={place.name}"]
        code = main([*arguments, *where])
        out, err = capsys.readouterr()
        return code, out.splitlines(), err.splitlines()

    return run


@pytest.fixture
def tell(place: Place) -> Callable[..., None]:
    """Return a function that writes the status of a job, as the operator does.

    Its keywords are fields of the status.
    """

    def write(name: str, phase: str, generation: int = 1, **fields: object) -> None:
        condition = {
            "type": phase,
            "status": "True",
            "reason": "Because",
            "message": "so it is",
            "lastTransitionTime": "2026-01-31T12:00:00Z",
        }
        status = {"phase": phase, "observedGeneration": generation, "conditions": [condition], **fields}
        place.api.merge(TRAINING_JOBS, place.name, name, {"status": status}, subresource="status")

    return write


@pytest.fixture
def server(tmp_path: Path) -> Iterator[tuple[Script, str]]:
    """Yield the script of the server, and a kubeconfig whose context has the namespace `robots`."""
    with serving() as (address, script):
        context = {"cluster": "c", "user": "u", "namespace": "robots"}
        content = {
            "current-context": "a",
            "contexts": [{"name": "a", "context": context}],
            "clusters": [{"name": "c", "cluster": {"server": address}}],
            "users": [{"name": "u", "user": {}}],
        }
        kubeconfig = tmp_path / "kubeconfig"
        kubeconfig.write_text(json.dumps(content))
        yield script, str(kubeconfig)
