"""What the tests of worlds share: small worlds, and the identity of one simulator."""

from collections.abc import Callable

import pytest

from palaestra_sim.world import RunIdentity

HEADER = b"#VRML_SIM R2023b utf8\n"


@pytest.fixture
def world() -> Callable[[str], bytes]:
    """Return what makes a world of the text below its first line."""
    return lambda text: HEADER + text.encode()


@pytest.fixture
def identity() -> RunIdentity:
    """Return the second collecting simulator of the first replica of a job."""
    return RunIdentity(job="move-to-target", uid="6f1c", replica=0, group="collect", index=1)
