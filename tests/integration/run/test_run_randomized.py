"""The jobs of docs/randomization.md: worlds that change in every episode, by its seed, and with training."""

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
EXAMPLE = Path(__file__).parents[3] / "examples/curriculum.py"
CURRICULUM = {"id": "curriculum:Curriculum-v0", "options": {"max_steps": 40}}
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


def module_at(path):
    """Return the module in a file."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def places(scene):
    """Where the cylinders stand."""
    return [scene.supervisor.get_field(name, "translation") for name in CYLINDERS]


def test_the_same_seed_places_the_same_cylinders(master, module):
    """And another seed others."""
    del master
    scattered = module_at(module)
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


@pytest.fixture
def curriculum(monkeypatch):
    """The module of the example, importable by every process of the test."""
    monkeypatch.setenv("PYTHONPATH", str(EXAMPLE.parent))
    return module_at(EXAMPLE)


def test_the_example_changes_world_and_robot_with_the_progress_of_training(master, curriculum):
    """No cylinder and no noise at first; the same episode is the same again."""
    del master
    webots = Webots("robotino", "arena")
    robot = Robotino(webots)
    env = curriculum.make(robot, SimulatedScene(webots, robot))
    seen = []
    try:
        with webots:
            for progress in (0.0, 0.25, 1.0, 1.0):
                first, _ = env.reset(seed=3, options={"training_progress": progress, "episode": 0})
                standing = sum(z > 0 for _, _, z in places(env.harder.scene))
                after = [env.step(1)[0].tolist() for _ in range(5)]
                seen.append((standing, first.tolist(), after))
    finally:
        robot.close()
        webots.stop()
        webots.close()

    assert [standing for standing, *_ in seen] == [0, 2, 4, 4]
    assert seen[2] == seen[3]
    assert seen[0][2] != seen[1][2] != seen[2][2]


@pytest.mark.parametrize(
    ("environment", "steps"), [(ENVIRONMENT, STEPS), (CURRICULUM, STEPS // 2)], ids=["page", "curriculum"]
)
def test_a_randomized_job_resumes_bit_for_bit(tmp_path, monkeypatch, module, environment, steps):
    """World, experience and parameters are those of a run that nothing interrupted.

    Each episode of the curriculum is replayed at the progress at which it began.
    """
    monkeypatch.setenv("PYTHONPATH", f"{module.parent}{os.pathsep}{EXAMPLE.parent}")
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    job = resume.job("DQN", 1)
    job["spec"]["trainer"] |= {"environment": environment, "steps": steps}
    for name in ("whole", "parts"):
        (tmp_path / name).mkdir()
    whole, parts = (LocalRun(tmp_path / name, job) for name in ("whole", "parts"))
    with whole:
        code, output = whole.end()
        assert code == 0, output

    with parts:
        parts.wait_for_step(steps * 2 // 3)
        os.kill(parts.trainer(), signal.SIGTERM)
        code, output = parts.end()

    assert code == 0, output
    assert len(parts.attempts()) == 2
    assert "do not repeat" not in parts.log()
    assert resume.results(parts.directory) == resume.results(whole.directory)
