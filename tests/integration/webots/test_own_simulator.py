"""An environment by its name alone, on a stub or on MuJoCo, and gymnasium's checker."""

import gymnasium
import pytest
from gymnasium.utils.env_checker import check_env

import palaestra_trainer.environments  # noqa: F401 - registers the environment

NAME = "MoveToTargetEnv-v0"
WRAPPED = "ignore:.*different from the unwrapped version"


@pytest.fixture
def nothing_configured(master, monkeypatch):
    """As in a notebook."""
    del master
    monkeypatch.delenv("PALAESTRA_CONFIG", raising=False)


@pytest.mark.usefixtures("nothing_configured")
def test_an_environment_made_by_its_name_alone_starts_a_simulator_that_ends_with_it():
    """Two of them have one each."""
    one, other = gymnasium.make(NAME), gymnasium.make(NAME)
    names = [env.unwrapped._robot.node_name for env in (one, other)]

    began = [env.reset(seed=1)[0].tolist() for env in (one, other)]
    one.step(0)
    one.close()
    other.step(0)
    other.close()
    other.close()

    assert began[0] == began[1]
    assert names[0] != names[1]


@pytest.mark.usefixtures("nothing_configured")
def test_an_environment_that_sees_starts_mujoco_by_its_name_alone():
    """The stub renders no images."""
    env = gymnasium.make("SeeTarget-v0")

    image, _ = env.reset(seed=1)
    env.close()

    assert image.shape == (48, 64, 3)
    assert image.std() > 0


@pytest.mark.filterwarnings(WRAPPED)
def test_the_checker_of_gymnasium_accepts_an_environment_on_a_simulated_robot(arena):
    """It makes the environment once more, from copies of its arguments."""
    check_env(gymnasium.make(NAME, robot=arena.robot, scene=arena.scene))
