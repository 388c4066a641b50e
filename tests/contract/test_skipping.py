"""`make test` on a machine without the programs of a cluster, such as a new user's machine."""

import os
import re
import subprocess
import sys
from pathlib import Path

from tests.control_plane.programs import REQUIRED

ROOT = Path(__file__).parents[2]
DEADLINE_S = 200


TESTS = (
    "tests/integration/monitoring/test_alerts_fire.py",  # the test itself needs programs
    "tests/integration/monitoring/test_dashboards_answer.py",  # a fixture needs programs
    "tests/unit/chart/test_chart_values.py",  # a function that the test calls needs programs
)


def test_what_needs_programs_that_nobody_built_is_skipped_in_one_line_with_the_command(tmp_path):
    """Hundreds of lines would hide how many tests were skipped, and which command builds the programs."""
    surroundings = {name: value for name, value in os.environ.items() if name != REQUIRED}
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *TESTS],
        cwd=ROOT,
        env=surroundings | {"PALAESTRA_CACHE": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=DEADLINE_S,
        check=False,
    )

    assert done.returncode == 0, done.stdout[-3000:]
    assert "failed" not in done.stdout
    [line] = [each for each in done.stdout.splitlines() if "need programs of a cluster" in each]
    command = re.search("`(.+)`", line)[1].split()
    assert command[0] == "tests/cluster/programs.sh"
    assert {"etcd", "helm", "prometheus"} <= set(command)
    assert int(line.split()[0]) > 100
