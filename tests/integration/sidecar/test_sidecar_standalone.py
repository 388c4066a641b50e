"""The folder with the sidecar for a user's own image contains only Python code and prometheus_client."""

import os
import shutil
import subprocess
import tomllib
from importlib.metadata import distribution
from pathlib import Path

import pytest

from palaestra_protocol.control import SidecarState
from tests.fake_webots.home import make_home

SIM_IMAGE = Path(__file__).parents[3] / "sim_image"


@pytest.fixture
def standalone(tmp_path):
    """Return the folder that the image's own script creates from the wheel's packages."""
    wheel = tomllib.loads((SIM_IMAGE / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"]
    installed = tmp_path / "installed"
    for package in wheel["wheel"]["packages"]:
        shutil.copytree(SIM_IMAGE / package, installed / Path(package).name)
    site = Path(distribution("palaestra-sim").locate_file(""))
    for library in [site / "prometheus_client", *site.glob("palaestra_sim-*.dist-info")]:
        shutil.copytree(library, installed / library.name)
    folder = tmp_path / "standalone"
    subprocess.run(["sh", SIM_IMAGE / "standalone.sh", folder, installed], check=True, timeout=60)
    shutil.rmtree(installed)
    return folder


def test_the_sidecar_runs_from_a_copied_folder(standalone, sidecar, waits, tmp_path) -> None:
    """The sidecar must need no environment and no installed package of the user's image."""
    moved = standalone.rename(tmp_path / "moved")

    it = sidecar(waits, before=("env", "-i"), executable=str(moved / "palaestra-sidecar"))

    assert it.start().state is SidecarState.STARTING
    assert "palaestra_sidecar_build_info" in it.ask("GET", "/metrics", address=it.health)[1]
    assert it.end() == 0


def test_webots_starts_the_controller_with_the_python_of_the_folder(
    standalone, run_sidecar, tmp_path
) -> None:
    """The image of a Webots may have no Python, or one that is too old."""
    moved, home = standalone.rename(tmp_path / "moved"), make_home(tmp_path, "R2025a")
    it = run_sidecar(
        [
            *("env", "-i", f"PATH={home}:{os.environ['PATH']}", f"WEBOTS_HOME={home}"),
            *("ROS_MASTER_URI=http://127.0.0.1:9", moved / "palaestra-sidecar", "--driver=webots"),
            *("--world=arena", "--job=j", f"--work={tmp_path}/work"),
            *("--control=127.0.0.1:0", "--health=127.0.0.1:0"),
        ]
    )

    it.request("/start")

    it.until_said("ros: no ROS master at http://127.0.0.1:9")  # the last step before the services
    controller = tmp_path / "work/webots/controllers/ros/ros.py"
    assert controller.read_text().startswith(f"#!{moved}/bin/python3\n")


def test_the_folder_has_no_simulator(standalone) -> None:
    """The image has a simulator of its own, and other code would only enlarge it."""
    packages = standalone / "lib/python3/dist-packages"

    assert {path.name.partition("-")[0] for path in packages.iterdir()} == {
        "palaestra_protocol",
        "palaestra_sim",
        "prometheus_client",
    }
    assert not (packages / "palaestra_sim/stub").exists()
    assert not (packages / "palaestra_sim/mujoco").exists()
