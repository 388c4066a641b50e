"""The scripts that people are told to run."""

import os
import subprocess
import sys
from pathlib import Path

EXAMPLES = Path(__file__).parents[3] / "examples"


def test_the_facade_example_drives_and_reads():
    """As typed in the README: no pod, no runner, no ROS master before."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("ROS_")}

    result = subprocess.run(
        [sys.executable, EXAMPLES / "facade.py"],
        capture_output=True,
        text=True,
        timeout=100,
        check=True,
        env=environment,
    )

    assert result.stdout.startswith("Pose(x_m=0.03")
    assert "free" in result.stdout
    assert result.stderr == ""
