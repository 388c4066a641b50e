"""A simulator in a container of a real Docker Engine, which is the engine that runs the cluster's nodes."""

import json
import subprocess
import sys

import pytest

from tests.chart.helm import ROOT
from tests.e2e.own_image import archives, skip_without_archives

RUN_S = 240
pytestmark = [pytest.mark.beside, pytest.mark.comes_late]


def test_simulators_start_in_containers_and_end_with_their_programs(namespace):
    """Other tests use a Docker API without containers, so only this test covers the network of containers."""
    del namespace  # only the engine of the cluster is needed
    skip_without_archives()
    beside = ROOT / "tests/cluster/beside_containers.sh"
    told = subprocess.run(
        [beside, archives()["stub"], sys.executable, "-m", "tests.e2e.containers"],
        cwd=ROOT,
        check=True,
        timeout=RUN_S,
        stdout=subprocess.PIPE,
        text=True,
    )

    seen = json.loads(told.stdout)
    assert seen["times"] == [pytest.approx(0.192)] * 2
    assert seen["names"] == ["robotino", "robotino_2"]
    assert "could not select device driver" in seen["refusal"]
    assert seen["left"] == []
