"""`control_plane` for tests: import it in a conftest.py. Skips where the programs are not built.

With PALAESTRA_REQUIRE_CLUSTER=1 (`.ci/run`, `make e2e`) nothing is skipped: the programs are built, or the
test fails.
"""

import os
from collections.abc import Iterator

import pytest

from tests.control_plane.plane import ControlPlane, running
from tests.control_plane.programs import REQUIRED, NoPrograms, programs


@pytest.fixture(scope="session")
def control_plane(tmp_path_factory) -> Iterator[ControlPlane]:
    """A control plane without nodes, shared by all tests of a folder: each uses a namespace of its own."""
    if os.environ.get(REQUIRED) != "1":
        try:
            programs()
        except NoPrograms as error:
            pytest.skip(str(error))
    with running(tmp_path_factory.mktemp("control-plane")) as plane:
        yield plane
