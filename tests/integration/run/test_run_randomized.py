"""The job of docs/randomization.md: cylinders that move in every episode, by its seed."""

import importlib.util
import os
import signal
from pathlib import Path

import pytest
import yaml

from palaestra_trainer.robots import Pose
from palaestra_trainer.robots.robotino import Robotino
from palaestra_trainer.robots.simulated import SimulatedScene
from palaestra_trainer.webots import Webots
from tests.local_run import LocalRun
from tests.pages import fenced
from tests.soak import resume

PAGE = dict(fenced((Path(__file__).parents[3] / "docs/randomization.md").read_text()))
ENVIRONMENT = yaml.safe_load(PAGE["yaml"])["spec"]["trainer"]["environment"]
STEPS = 600
CYLINDERS = [f"CYLINDER_{number}" for number in range(4)]


@pytest.fixture
def module(tmp_path, monkeypatch):
    """The folder of the page's module, importable by every process of the test."""
    folder = tmp_path / "modules"
    folder.mkdir()
    (folder / "scattered.py").write_text(PAGE["python in-a-job"])
    monkeypatch.setenv("PYTHONPATH", str(folder))
    return folder / "scattered.py"


def places(scene):
    """Where the cylinders stand."""
    return [scene.supervisor.get_field(name, "translation") for name in CYLINDERS]


def test_the_same_seed_places_the_same_cylinders(master, module):
    """And another seed others."""
    del master
    spec = importlib.util.spec_from_file_location("scattered", module)
    scattered = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(scattered)
    webots = Webots("robotino", "arena")
    robot = Robotino(webots)
    scene = SimulatedScene(webots, robot)
    moving = scattered.ScatteredScene(scene)
    try:
        with webots:
            seen = []
            for seed in (1, 2, 1):
                moving.reset(seed, Pose(-1.5, 0.0, 0.0), (1.5, 0.0))
                seen.append((places(scene), robot.distances().tolist()))
    finally:
        robot.close()
        webots.stop()
        webots.close()

    assert seen[0] == seen[2]
    assert seen[0][0] != seen[1][0]


def test_the_job_of_the_page_resumes_bit_for_bit(tmp_path, monkeypatch, module):
    """Cylinders, experience and parameters are those of a run that nothing interrupted."""
    del module
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    job = resume.job("DQN", 1)
    job["spec"]["trainer"] |= {"environment": ENVIRONMENT, "steps": STEPS}
    for name in ("whole", "parts"):
        (tmp_path / name).mkdir()
    whole, parts = (LocalRun(tmp_path / name, job) for name in ("whole", "parts"))
    with whole:
        code, output = whole.end()
        assert code == 0, output

    with parts:
        parts.wait_for_step(STEPS // 3)
        os.kill(parts.trainer(), signal.SIGTERM)
        code, output = parts.end()

    assert code == 0, output
    assert len(parts.attempts()) == 2
    assert "do not repeat" not in parts.log()
    assert resume.results(parts.directory) == resume.results(whole.directory)
