"""The class of a job's robot is found, and an environment is made with the robot."""

from __future__ import annotations

import gymnasium
import pytest

from palaestra.api.fields import ROBOTS
from palaestra_trainer.environments.make import make_environment
from palaestra_trainer.errors import ConfigurationError, MissingCapability
from palaestra_trainer.job.configuration import Environment
from palaestra_trainer.robots import Joints, RobotAbc, SceneWrapper
from palaestra_trainer.robots.differential import DifferentialDrive, TurtleBot3Burger
from palaestra_trainer.robots.joints import JointRobot
from palaestra_trainer.robots.robotino import Robotino
from palaestra_trainer.simulators.robot_registry import SHIPPED, robot_class
from palaestra_trainer.testing import fake_arena, fake_court


@pytest.fixture
def module(tmp_path, monkeypatch):
    """`module(source)` returns the name of an importable module with this source."""

    def write(source):
        (tmp_path / "mybots.py").write_text(source)
        monkeypatch.syspath_prepend(tmp_path)
        monkeypatch.delitem(__import__("sys").modules, "mybots", raising=False)

    return write


@pytest.mark.parametrize("name", SHIPPED)
def test_a_robot_that_ships_has_a_short_name(name):
    """A person writes `Robotino` in a job, and not the module of the class."""
    assert robot_class(name).__name__ == name


def test_a_job_may_name_each_robot_that_ships():
    """The API does not import the trainer, so it has its own list. Other robots are named as module:Class."""
    assert set(ROBOTS) == set(SHIPPED)


def test_a_robot_of_your_own_is_named_by_its_module(module):
    """A user may write a subclass with other device names."""
    module(
        "from palaestra_trainer.robots.robotino import Robotino\n"
        "class MyBot(Robotino):\n    definition = 'MYBOT'\n"
    )

    found = robot_class("mybots:MyBot")

    assert issubclass(found, Robotino)
    assert found.definition == "MYBOT"


@pytest.mark.parametrize(
    ("name", "fact"),
    [
        ("Robotno", "trainer.robot: Robotno is not known; did you mean Robotino?"),
        ("nowhere:Robot", "trainer.robot: nowhere:Robot cannot be imported"),
        ("mybots:Gone", "trainer.robot: mybots:Gone cannot be imported"),
        ("mybots:Thing", "trainer.robot: mybots:Thing is not a RobotAbc; derive the class from"),
        ("mybots:number", "trainer.robot: mybots:number is not a RobotAbc"),
        ("mybots:Real", "trainer.robot: mybots:Real is a RobotAbc, but not a SimulatedRobot"),
        ("mybots:Half", "trainer.robot: mybots:Half does not implement the method bumped; add it"),
    ],
)
def test_what_is_no_class_of_a_robot_is_refused_before_anything_starts(module, name, fact):
    """A person waits only seconds for the error, which has the field, the mistake and the remedy."""
    module(
        "from palaestra_trainer.robots import Bumper\n"
        "from palaestra_trainer.robots.differential import TurtleBot3Burger\n"
        "from palaestra_trainer.testing import FakeRobotino\n"
        "class Thing: pass\n"
        "class Half(TurtleBot3Burger, Bumper): pass\n"
        "Real, number = FakeRobotino, 7\n"
    )

    with pytest.raises(ConfigurationError) as refusal:
        robot_class(name)

    assert str(refusal.value).startswith(fact)


@pytest.fixture
def sorting():
    """Register an environment that needs a robot with joints, for the time of the test."""

    class Sorting(gymnasium.Env):
        needs = (Joints,)

        def __init__(self, robot, scene):
            raise AssertionError(f"made for {robot} in {scene}")

    gymnasium.register(id="Sorting-v0", entry_point=Sorting)
    yield "Sorting-v0"
    gymnasium.registry.pop("Sorting-v0")


def test_an_environment_is_not_made_for_a_robot_that_does_not_fit(sorting):
    """An author must find the name from the job in the message, and not only that of a class."""
    with pytest.raises(MissingCapability, match="FakeRobotino has no Joints, which Sorting-v0 needs"):
        make_environment(Environment(id=sorting), *fake_arena())


@pytest.mark.parametrize("name", ["MoveToTargetEnv-v0", "Deliver-v0", "SeeTarget-v0"])
def test_a_task_of_the_arena_needs_a_robotino(name):
    """A robot with two wheels cannot drive sideways, as the task requires."""
    with pytest.raises(MissingCapability, match="FakeBurger has no RobotinoAbc"):
        make_environment(Environment(id=name), *fake_court())


def test_a_robot_of_joints_without_motors_is_refused():
    """`JointRobot` itself has no joint names; a user's subclass must set them."""
    with pytest.raises(ConfigurationError, match="JointRobot has 0 motors and 0 numbers in greatest"):
        JointRobot(None)


def test_what_ships_inherits_what_the_page_says():
    """The table in docs/howto/robots.md must agree with the classes."""
    assert issubclass(TurtleBot3Burger, DifferentialDrive)
    assert all(issubclass(robot_class(name), RobotAbc) for name in SHIPPED)


def test_a_wrapper_passes_everything_on_to_its_scene():
    """A user's scene can then override a single method."""
    robot, scene = fake_court()
    wrapped = SceneWrapper(scene)
    pose = robot.pose()

    wrapped.begin(1)
    wrapped.put("BOX_0", (0.0, 0.0, 0.15))
    wrapped.place(pose, (1.0, 0.5))

    assert wrapped.layout() == scene.layout()
    assert wrapped.layout().gap(0.0, 0.0) < 0.0
    assert scene.target == (1.0, 0.5)
    wrapped.mark((0.5, 1.0))
    assert scene.target == (0.5, 1.0)
