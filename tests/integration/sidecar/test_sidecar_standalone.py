"""The folder with the sidecar for a user's own image contains only Python code and prometheus_client."""

import shutil
import subprocess
import tomllib
from importlib.metadata import distribution
from pathlib import Path

import pytest

from palaestra_protocol.control import SidecarState

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


def test_the_folder_has_nothing_that_speaks_ros(standalone) -> None:
    """A sidecar only starts and stops a process, and other code would only enlarge every image."""
    packages = standalone / "lib/python3/dist-packages"

    assert {path.name.partition("-")[0] for path in packages.iterdir()} == {
        "palaestra_protocol",
        "palaestra_sim",
        "prometheus_client",
    }
    assert not (packages / "palaestra_protocol/ros").exists()
    assert not (packages / "palaestra_sim/stub").exists()
