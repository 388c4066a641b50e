"""`make setup` for a user who may not install ROS, on a machine without it."""

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[3] / "tools/setup.sh"
PACKAGES = (
    "python3-rospy python3-rosmaster python3-netifaces python3-venv "
    "python3-rosmsg python3-rosservice python3-rostopic python3-sensor-msgs ros-sensor-msgs "
    "g++ libroscpp-dev libsensor-msgs-dev python3-gencpp libegl1 libgl1-mesa-dri libopengl0"
)
NOBODY = ("setpriv", "--reuid", "65534", "--clear-groups")


@pytest.fixture
def checkout():
    """A folder with only the script, writable for everybody, and a rospy that cannot be imported."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        for name in ("tools", "modules"):
            (path / name).mkdir()
        shutil.copy(SCRIPT, path / "tools/setup.sh")
        (path / "modules/rospy.py").write_text("raise ImportError\n")
        for each in (path, *path.rglob("*")):
            each.chmod(0o777)
        yield path


def test_without_root_and_ros_it_prints_the_one_line_to_type_and_stops(checkout):
    """Nothing is installed without consent, and nothing is half done."""
    before = sorted(checkout.rglob("*"))

    setup = subprocess.run(
        [*(NOBODY if os.geteuid() == 0 else ()), checkout / "tools/setup.sh"],
        env={**os.environ, "PYTHONPATH": str(checkout / "modules"), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )

    assert (setup.returncode, setup.stderr) == (1, "")
    assert setup.stdout.splitlines() == [
        "Packages are missing. Type this line, then repeat the command:",
        f"  sudo apt-get update && sudo apt-get install -y --no-install-recommends {PACKAGES}",
    ]
    assert sorted(checkout.rglob("*")) == before
