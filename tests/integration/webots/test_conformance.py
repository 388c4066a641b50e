"""The simulated Robotino passes what every Robotino has to pass, and the same environment runs on it."""

from gymnasium.utils.env_checker import check_env

from palaestra_trainer.robots import Pose
from palaestra_trainer.simulators.entry_point import make
from palaestra_trainer.testing import check_robot, check_scene


def test_the_simulated_robotino_conforms(arena):
    """The suite that the fake and, later, the real robot pass too."""
    arena.scene.reset(1, Pose(0.0, 0.0, 0.0), (1.0, 0.0))

    check_robot(arena.robot)


def test_its_scene_conforms(arena):
    """The scene is as arranged, and the seed determines what is random."""
    check_scene(arena.robot, arena.scene, Pose(-1.0, 0.1, 0.5), (1.0, 0.0))


def test_the_environment_on_it_passes_gymnasiums_checks(arena):
    """Seeds give the same episodes over ROS too: the stub is deterministic."""
    check_env(make(arena.robot, arena.scene), skip_render_check=True)
