"""`gymnasium.make` with only a name starts a simulator; gymnasium's checker accepts the environment."""

import gymnasium
import pytest
import yaml
from gymnasium.utils.env_checker import check_env

import palaestra_trainer.environments
from palaestra_trainer.errors import Paused, SimulatorDead
from palaestra_trainer.simulators.notebook_simulator import offered_simulator
from palaestra_trainer.webots import Attached, Webots

NAME = "MoveToTargetEnv-v0"
WRAPPED = "ignore:.*different from the unwrapped version"


@pytest.fixture
def nothing_configured(master, monkeypatch):
    """Remove the configuration of a job, as in a notebook."""
    del master
    monkeypatch.delenv("PALAESTRA_CONFIG", raising=False)


@pytest.mark.usefixtures("nothing_configured")
def test_an_environment_made_by_its_name_alone_starts_a_simulator_that_ends_with_it():
    """Two environments need two simulators, because a step of one must not move the other's robot."""
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
@pytest.mark.parametrize("make", [gymnasium.make, palaestra_trainer.make_env], ids=["plain", "tolerant"])
def test_an_environment_that_sees_starts_mujoco_by_its_name_alone(make):
    """The stub renders no images, so such an environment must start MuJoCo."""
    env = make("SeeTarget-v0")

    image, _ = env.reset(seed=1)
    env.close()

    assert image.shape == (48, 64, 3)
    assert image.std() > 0


@pytest.mark.usefixtures("nothing_configured")
@pytest.mark.parametrize("make", [gymnasium.make, palaestra_trainer.make_env], ids=["plain", "tolerant"])
def test_an_environment_of_another_robot_starts_the_world_of_that_robot(make):
    """`Navigate-v0` drives a TurtleBot3, which the world `court` contains."""
    env = make("Navigate-v0")
    first, _ = env.reset(seed=1)
    env.close()

    assert env.observation_space.contains(first)


@pytest.mark.usefixtures("nothing_configured")
def test_an_environment_of_another_robot_finds_it_in_the_facade_of_the_program():
    """The facade has no robot yet, so the environment must create the robot of its own class."""
    webots = Webots("burger", "court")
    try:
        env = gymnasium.make("Navigate-v0")
        with webots:
            first, _ = env.reset(seed=1)
        env.close()
    finally:
        webots.stop()
        webots.close()

    assert env.observation_space.contains(first)


@pytest.mark.usefixtures("nothing_configured")
def test_the_robot_in_a_facade_is_that_of_the_job(tmp_path, monkeypatch):
    """The class of the robot comes from the job, also if the program of the job creates the facade."""
    job = {
        "job": "j",
        "environment": {"id": "Navigate-v0"},
        "robot": "EPuck",
        "steps": 1,
        "simulators": [{"name": "collect-0", "group": "collect", "index": 0, "role": "Collect"}],
    }
    (tmp_path / "training.yaml").write_text(yaml.safe_dump(job))
    monkeypatch.setenv("PALAESTRA_CONFIG", str(tmp_path / "training.yaml"))
    webots = Webots("epuck", "desk.wbt", launcher=Attached())

    place = offered_simulator("court")

    assert place.webots is webots
    assert type(place.robot).__name__ == "EPuck"
    webots.close()


@pytest.fixture
def webots(nothing_configured):
    """Yield a facade that a test creates as a notebook does."""
    del nothing_configured
    made = Webots("robotino", "arena")
    yield made
    made.stop()
    made.close()


def test_an_environment_uses_the_facade_that_was_made_before_it(webots):
    """In the paper, a reset of the environment starts the facade's simulator, which `run` then pauses."""
    env = gymnasium.make(NAME)

    first, _ = webots.run(lambda: env.reset(seed=1))
    with webots:
        env.step(0)
    with pytest.raises(Paused):
        env.step(0)
    env.close()
    with gymnasium.make(NAME) as again, webots:  # the simulator runs already
        assert again.reset(seed=1)[0].tolist() == first.tolist()


def test_a_facade_s_simulator_that_breaks_is_mended_where_it_broke(webots):
    """After the step, `run` pauses the simulator, so the simulator must have been restarted by then."""
    env = palaestra_trainer.make_env(NAME)
    webots.run(lambda: env.reset(seed=1))
    webots.supervisor.quit()

    *_, truncated, info = webots.run(lambda: env.step(0))

    assert truncated
    assert "was restarted during the episode" in info["palaestra"]["sim_fault"]["fact"]
    webots.run(lambda: env.reset(seed=1))
    assert not webots.run(lambda: env.step(0))[3]
    env.close()


def test_an_episode_does_not_go_on_in_a_simulator_that_the_program_restarted(webots):
    """The restarted robot has another position, so the next observations would be plausible but wrong."""
    env = palaestra_trainer.make_env(NAME)
    webots.run(lambda: env.reset(seed=1))
    webots()

    *_, truncated, info = webots.run(lambda: env.step(0))

    assert truncated
    assert info["palaestra"]["sim_fault"]["kind"] == SimulatorDead.kind
    env.close()


@pytest.mark.filterwarnings(WRAPPED)
def test_the_checker_of_gymnasium_accepts_an_environment_on_a_simulated_robot(arena):
    """The checker creates the environment a second time from copies of its arguments."""
    check_env(gymnasium.make(NAME, robot=arena.robot, scene=arena.scene))
