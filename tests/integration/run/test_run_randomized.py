"""The worlds of docs/howto/randomization.md change in every episode, by the seed and by the progress.

The tests in test_run_exact_resume.py train, interrupt and resume the page's jobs.
"""

import importlib.util
from pathlib import Path

import pytest

from palaestra_trainer.robots import Pose
from palaestra_trainer.robots.robotino import Robotino
from palaestra_trainer.robots.simulated import SimulatedScene
from palaestra_trainer.webots import Webots
from tests.pages import fenced

PAGE = dict(fenced((Path(__file__).parents[3] / "docs/howto/randomization.md").read_text()))
EXAMPLE = Path(__file__).parents[3] / "examples/curriculum.py"
CYLINDERS = [f"CYLINDER_{number}" for number in range(4)]


@pytest.fixture
def module(tmp_path):
    """Write the page's module, and return the file."""
    path = tmp_path / "scattered.py"
    path.write_text(PAGE["python in-a-job"])
    return path


def module_at(path):
    """Import a file, and return the module."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def places(scene):
    """Return the positions of all cylinders in a scene."""
    return [scene.supervisor.get_field(name, "translation") for name in CYLINDERS]


def test_the_same_seed_places_the_same_cylinders(master, module):
    """A user can repeat an episode by its seed, and another seed gives another world."""
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
def curriculum():
    """Return the module of the example curriculum."""
    return module_at(EXAMPLE)


def test_the_example_changes_world_and_robot_with_the_progress_of_training(master, curriculum):
    """The world of a curriculum gets harder with the progress.

    At progress 0 the episode has no cylinders and no noise, and a repeated episode is equal.
    """
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
