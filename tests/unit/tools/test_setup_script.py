"""What `make setup` and `make test` do for somebody who may not install packages of the distribution."""

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import pytest

TOOLS = Path(__file__).parents[3] / "tools"
LINE = "  sudo apt-get update && sudo apt-get install -y --no-install-recommends"
WITHOUT_ENSUREPIP = (
    "/usr/bin/python3 cannot make an environment without ensurepip. "
    "Install uv, or type this line; then repeat the command:"
)
PACKAGES = (
    "python3-rospy python3-rosmaster python3-netifaces "
    "python3-rosmsg python3-rosservice python3-rostopic python3-sensor-msgs ros-sensor-msgs "
    "g++ libroscpp-dev libsensor-msgs-dev python3-gencpp libegl1 libgl1-mesa-dri libopengl0"
)
NOBODY = ("setpriv", "--reuid", "65534", "--clear-groups")


@pytest.fixture
def checkout():
    """A folder with the scripts alone, that anybody may write into, and modules that cannot be imported."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        (path / "modules").mkdir()
        (path / "tools").mkdir()
        for name in ("setup.sh", "test-packages.sh"):
            shutil.copy(TOOLS / name, path / "tools" / name)
        for name in ("rospy", "ensurepip"):
            (path / "modules" / f"{name}.py").write_text("raise ImportError\n")
        (path / "requirements.lock").write_text("uv==0.9.0\n")
        for each in (path, *path.rglob("*")):
            each.chmod(0o777)
        yield path


@pytest.mark.parametrize(
    ("script", "lines"),
    [
        (
            "setup.sh",
            [
                WITHOUT_ENSUREPIP,
                f"{LINE} python3-venv",
            ],
        ),
        (
            "test-packages.sh",
            [
                "Packages for the tests are missing. Type this line, then repeat the command:",
                f"{LINE} {PACKAGES}",
            ],
        ),
    ],
)
def test_without_root_it_prints_the_one_line_to_type_and_stops(checkout, script, lines):
    """Nothing is installed behind the back of a person, and nothing is half done; ROS is for tests alone."""
    before = sorted(checkout.rglob("*"))

    done = subprocess.run(
        [*(NOBODY if os.geteuid() == 0 else ()), checkout / "tools" / script],
        env={
            **os.environ,
            "PATH": "/usr/bin:/bin",
            "PYTHONPATH": str(checkout / "modules"),
            "PYTHONDONTWRITEBYTECODE": "1",
        },
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )

    assert (done.returncode, done.stderr) == (1, "")
    assert done.stdout.splitlines() == lines
    assert sorted(checkout.rglob("*")) == before
