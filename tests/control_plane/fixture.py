"""A control plane for the tests of a folder. Skips them where its programs are not built.

With PALAESTRA_REQUIRE_CLUSTER=1 (`.ci/run`) nothing is skipped: the programs are built, or the test fails.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.control_plane.plane import ControlPlane, running
from tests.control_plane.programs import REQUIRED, NoPrograms, programs


@contextmanager
def running_or_skipped(folder: Path, *, kinds: Path | None = None) -> Iterator[ControlPlane]:
    """Run a control plane, as `running` does, until the block ends; skip the test where it cannot be."""
    if os.environ.get(REQUIRED) != "1":
        try:
            programs()
        except NoPrograms as error:
            pytest.skip(str(error))
    with running(folder, kinds=kinds) as plane:
        yield plane
