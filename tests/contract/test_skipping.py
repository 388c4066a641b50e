"""`make test` on a machine where no program of a cluster was ever built, as every newcomer's is."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.control_plane.programs import REQUIRED

ROOT = Path(__file__).parents[2]
DEADLINE_S = 200


@pytest.mark.parametrize(
    "tests",
    [
        "tests/integration/monitoring/test_alerts_fire.py",
        "tests/integration/monitoring/test_dashboards_answer.py",
        "tests/unit/chart/test_chart_values.py",
    ],
)
def test_what_needs_programs_that_nobody_built_is_skipped_with_the_command_that_builds_them(tests, tmp_path):
    """Whether a test asks for them itself, or a fixture does, or what it calls."""
    surroundings = {name: value for name, value in os.environ.items() if name != REQUIRED}
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-rs", "-p", "no:cacheprovider", tests],
        cwd=ROOT,
        env=surroundings | {"PALAESTRA_CACHE": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=DEADLINE_S,
        check=False,
    )

    assert done.returncode == 0, done.stdout[-3000:]
    assert "build them once (minutes) with tests/cluster/programs.sh" in done.stdout
    assert "failed" not in done.stdout
