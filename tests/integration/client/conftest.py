"""A control plane that knows TrainingJobs, a namespace for each test, and its client."""

from collections.abc import Callable, Iterator

import pytest

from palaestra import Client
from palaestra.api.crd import crd
from palaestra.cli import main
from palaestra.cluster import Api, NotFound, connect
from palaestra.cluster.resources import DEFINITIONS, TRAINING_JOBS
from tests.control_plane.fixture import control_plane
from tests.control_plane.plane import ControlPlane
from tests.integration.operator.cluster import Place, eventually

__all__ = ["control_plane"]


@pytest.fixture(scope="session")
def installed(control_plane: ControlPlane) -> Iterator[Api]:
    """An administrator's client, once the API server knows TrainingJobs."""
    api = connect(str(control_plane.kubeconfig))
    api.create(DEFINITIONS, crd())

    def served() -> bool:
        try:
            api.list(TRAINING_JOBS)
        except NotFound:
            return False
        return True

    eventually(served)
    yield api
    api.close()


@pytest.fixture
def place(installed: Api) -> Place:
    """A namespace of the test's own."""
    return Place(installed)


@pytest.fixture
def client(control_plane: ControlPlane, place: Place) -> Iterator[Client]:
    """A client of that namespace."""
    with Client(namespace=place.name, kubeconfig=str(control_plane.kubeconfig)) as made:
        yield made


@pytest.fixture
def typed(
    control_plane: ControlPlane, place: Place, capsys: pytest.CaptureFixture[str]
) -> Callable[..., tuple[int, list[str], list[str]]]:
    """Type a command; return its exit code and its lines on both outputs."""

    def run(*arguments: str) -> tuple[int, list[str], list[str]]:
        where = [f"--kubeconfig={control_plane.kubeconfig}", f"--namespace={place.name}"]
        code = main([*arguments, *where])
        out, err = capsys.readouterr()
        return code, out.splitlines(), err.splitlines()

    return run


@pytest.fixture
def tell(place: Place) -> Callable[..., None]:
    """Write the status of a job, as the operator does; keywords are fields of it."""

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
