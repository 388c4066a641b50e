"""The fixture that starts operators in the namespace of a test."""

import fcntl
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from palaestra.cluster import Api, NotFound
from palaestra.cluster.resources import LEASES
from palaestra.operator.options import DEFAULT_NAMESPACE as NAMESPACE
from palaestra.operator.options import NAME
from tests.control_plane.plane import ControlPlane
from tests.integration.operator.cluster import Place
from tests.integration.operator.installed import USER
from tests.integration.operator.operators import RunningOperator

Start = Callable[..., RunningOperator]


@pytest.fixture
def start(control_plane: ControlPlane, installed: Api, place: Place, tmp_path: Path) -> Iterator[Start]:
    """Yield a function that starts operators for this namespace, with the permissions of an installation.

    The operators have no leader election unless a test requests it. All tests share one Lease, so only one
    test at a time may have an election.
    """
    kubeconfig = control_plane.kubeconfig_of(USER, "system:serviceaccounts")
    started: list[RunningOperator] = []
    turn = (control_plane.folder / "election.lock").open("w")

    def begin(*options: str, elect: bool = False, dies_after: int | None = None) -> RunningOperator:
        election = "--leader-elect" if elect else "--no-leader-elect"
        if elect and not started:
            fcntl.flock(turn, fcntl.LOCK_EX)
            with suppress(NotFound):  # otherwise an earlier test's Lease must first expire
                installed.delete(LEASES, NAMESPACE, NAME)
        log = tmp_path / f"operator-{len(started)}.log"
        common = (f"--namespace={place.name}", election, *options)
        started.append(RunningOperator(kubeconfig, log, *common, dies_after=dies_after))
        return started[-1]

    yield begin
    for each in started:
        each.kill()
    turn.close()
