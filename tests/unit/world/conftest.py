"""Small worlds and the identity of one simulator, for the tests of worlds."""

from collections.abc import Callable

import pytest

from palaestra_sim.world import RunIdentity

HEADER = b"#VRML_SIM R2023b utf8\n"


@pytest.fixture
def world() -> Callable[[str], bytes]:
    """Return a function that adds the first line to the text of a world."""
    return lambda text: HEADER + text.encode()


@pytest.fixture
def identity() -> RunIdentity:
    """Return the second collecting simulator of the first replica of a job."""
    return RunIdentity(job="move-to-target", uid="6f1c", replica=0, group="collect", index=1)
