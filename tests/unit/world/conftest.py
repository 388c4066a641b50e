"""Small worlds, and the identity of one simulator."""

from collections.abc import Callable

import pytest

from palaestra_sim.world import RunIdentity

HEADER = b"#VRML_SIM R2023b utf8\n"


@pytest.fixture
def world() -> Callable[[str], bytes]:
    """Return a function that puts the header of a world before a text."""
    return lambda text: HEADER + text.encode()


@pytest.fixture
def identity() -> RunIdentity:
    """Return the identity of the second collecting simulator of a job's first replica."""
    return RunIdentity(job="move-to-target", uid="6f1c", replica=0, group="collect", index=1)
