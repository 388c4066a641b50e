"""The blocks of the pages about devices and the supervisor print the same in the stub and in MuJoCo."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.pages import blocks

HOWTO = Path(__file__).parents[3] / "docs" / "howto"
RUN_S = 120
STUB = 'driver="stub"'


@pytest.mark.parametrize("driver", ["stub", "mujoco"])
@pytest.mark.parametrize("page", ["sensors", "actuators", "supervisor"])
def test_a_page_prints_what_it_shows_in_each_simulator(page, driver, tmp_path):
    """A reader copies world and script; each printed number follows from the world's text."""
    text = (HOWTO / f"{page}.md").read_text()
    for world in blocks(text, "text lab.wbt"):
        (tmp_path / "lab.wbt").write_text(world)
    script = "\n".join(blocks(text, "python lab.py"))
    assert STUB in script

    told = subprocess.run(
        [sys.executable, "-c", script.replace(STUB, f'driver="{driver}"')],
        cwd=tmp_path,
        env={name: value for name, value in os.environ.items() if not name.startswith("ROS_")},
        capture_output=True,
        text=True,
        timeout=RUN_S,
        check=False,
    )

    assert told.stderr == ""
    assert told.stdout.replace("-0.0 ", "0.0 ") == "".join(blocks(text, "text output"))
