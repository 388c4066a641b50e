"""The simulated Robotino passes the checks for every Robotino, and the same environment runs on it."""

from gymnasium.utils.env_checker import check_env

from palaestra_trainer.robots import Pose
from palaestra_trainer.simulators.entry_point import make
from palaestra_trainer.testing import check_robot, check_scene


def test_the_simulated_robotino_conforms(arena):
    """The fake passes this suite too, and so must the real robot later."""
    arena.scene.reset(1, Pose(0.0, 0.0, 0.0), (1.0, 0.0))

    check_robot(arena.robot)


def test_its_scene_conforms(arena):
    """The scene has the given arrangement, and the seed determines all random values."""
    check_scene(arena.robot, arena.scene, Pose(-1.0, 0.1, 0.5), (1.0, 0.0))


def test_the_environment_on_it_passes_gymnasiums_checks(arena):
    """Seeds give the same episodes over ROS too, because the stub is deterministic."""
    check_env(make(arena.robot, arena.scene), skip_render_check=True)
