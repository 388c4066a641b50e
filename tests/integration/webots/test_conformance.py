"""The simulated Robotino passes the checks for every Robotino, and the environment runs on it."""

from gymnasium.utils.env_checker import check_env

from palaestra_trainer.robots import Pose
from palaestra_trainer.simulators.entry_point import make
from palaestra_trainer.testing import check_robot, check_scene


def test_the_simulated_robotino_conforms(arena):
    """The fake passes the same checks, so code for one robot works on the other."""
    arena.scene.reset(1, Pose(0.0, 0.0, 0.0), (1.0, 0.0))

    check_robot(arena.robot)


def test_its_scene_conforms(arena):
    """An environment needs the arrangement that it requests.

    Its random values must depend only on the seed.
    """
    check_scene(arena.robot, arena.scene, Pose(-1.0, 0.1, 0.5), (1.0, 0.0))


def test_the_environment_on_it_passes_gymnasiums_checks(arena):
    """The stub is deterministic, so over ROS, too, a seed must give the same episode."""
    check_env(make(arena.robot, arena.scene), skip_render_check=True)
