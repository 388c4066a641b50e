"""Making the batched form of a user's environment: its arguments, and the reasons to reject it."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from palaestra_trainer.environments.batched import BatchedEnv
from palaestra_trainer.environments.make import make_batched
from palaestra_trainer.errors import ConfigurationError, NoReading, SimulatorDead
from palaestra_trainer.job.configuration import Environment
from palaestra_trainer.robots.batch_link import BatchLink
from palaestra_trainer.robots.batched import BatchedJointRobot, BatchedRobotino, BatchedScene, batched_form
from palaestra_trainer.robots.batched_base import BatchedJointsAbc
from palaestra_trainer.robots.geometry import Pose
from palaestra_trainer.robots.robotino import Robotino
from tests.unit.trainer.environments.hall import NAME, Hall

ROWS = 2


class BatchedHall(BatchedEnv):
    """The batched form of `Hall`, whose arguments are its robot and an option; it takes no steps."""

    def __init__(self, robot, size=4.0):
        self.size = size
        super().__init__(robot.rows, spaces.Box(-1.0, 1.0, (2,), np.float32), spaces.Discrete(2))


@pytest.fixture
def robot():
    """Return the copies of a robot, which are not connected."""
    return BatchedRobotino(Robotino, BatchLink("collect-0"), ROWS)


@pytest.fixture
def batched(register, robot):
    """Register the batched form of an environment, and make it as a run makes it."""

    def make(creator, **task):
        register(Hall, vector_entry_point=creator)
        return make_batched(Environment(id=NAME, **task), robot, BatchedScene(robot))

    return make


def test_a_batched_form_gets_its_options_and_what_its_signature_accepts(batched):
    """Both forms of an environment have the same options, so a job may add `batch` later."""
    env = batched(BatchedHall, options={"size": 6.0})

    assert (env.num_envs, env.size) == (ROWS, 6.0)


def test_a_batched_form_gets_the_arguments_of_its_registration(register, robot):
    """Both forms must play one task; the job's options come first, as in `gymnasium.make`."""
    register(Hall, vector_entry_point=BatchedHall, kwargs={"size": 6.0})

    sizes = [
        make_batched(Environment(id=NAME, options=options), robot, BatchedScene(robot)).size
        for options in ({}, {"size": 8.0})
    ]

    assert sizes == [6.0, 8.0]


def test_wrappers_of_the_registration_are_refused(register, robot):
    """They wrap the single environment only, so the copies would play another task."""
    clip = gymnasium.wrappers.ClipReward.wrapper_spec(min_reward=-1.0, max_reward=1.0)
    register(Hall, vector_entry_point=BatchedHall, additional_wrappers=(clip,))

    with pytest.raises(ConfigurationError, match="additional_wrappers of its registration: has no batched"):
        make_batched(Environment(id=NAME), robot, BatchedScene(robot))


def test_options_that_the_batched_form_lacks_are_refused(batched):
    """The copies would play another task than the single environment that evaluates the policy."""
    with pytest.raises(ConfigurationError, match=r"environment\.options\.siez: .* did you mean size\?"):
        batched(BatchedHall, options={"siez": 6.0})


def test_a_batched_form_whose_constructor_raises_is_a_mistake_of_the_configuration(batched):
    """A retry would raise the same error."""

    class Strict(BatchedHall):
        def __init__(self, robot):
            raise ValueError(f"the hall is too small for {robot.rows}")

    with pytest.raises(
        ConfigurationError, match=r"batched form of Hall-v0 cannot be created \(ValueError: the hall is too"
    ):
        batched(Strict)


def test_a_fault_of_a_simulator_in_a_batched_form_is_no_mistake_of_the_configuration(batched):
    """A restarted simulator may respond."""

    class Asking(BatchedHall):
        def __init__(self, robot):
            raise SimulatorDead(f"of {robot.rows} copies", "its connection was closed")

    with pytest.raises(SimulatorDead):
        batched(Asking)


def test_a_batched_form_that_is_no_batched_environment_is_refused(batched):
    """The attribute `batched` is a promise; without the base class, resets of single rows would fail."""

    class Single(Hall):
        batched = True

        def __init__(self, robot):
            self.given = {"robot": robot}

    with pytest.raises(ConfigurationError, match="vector_entry_point of Hall-v0 is not a BatchedEnv; derive"):
        batched(Single)


def test_a_batched_form_for_another_kind_of_robot_names_the_kind(batched):
    """The error comes before a simulator starts, and not from the first reset."""

    class OfJoints(BatchedHall):
        needs = (BatchedJointsAbc,)

    with pytest.raises(ConfigurationError, match="needs BatchedJointsAbc, but the robot's form"):
        batched(OfJoints)


def test_an_environment_without_a_batched_form_is_refused(batched):
    """The message names both remedies: register a batched form, or remove `batch` from the job."""
    with pytest.raises(ConfigurationError, match=r"has no batched form, .* register .* or remove batch"):
        batched(None)


def test_readings_before_the_first_reset_are_refused(robot):
    """Zeros would look like obstacles at every side of the robot."""
    with pytest.raises(NoReading, match="collect-0: its sensors have sent no reading yet; reset the rows"):
        robot.values()


def test_a_world_without_a_floor_has_no_layout(robot):
    """Free places are searched on the floor, whose size must be known."""
    with pytest.raises(ConfigurationError, match="world: has no floor; write DEF FLOOR before the Solid"):
        BatchedScene(robot).layout()


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, r"starts of the shape \(0,\), but the rows need \(2, 6\)"),
        ({"starts": [Pose(0.0, 0.0, 0.0)]}, r"starts of the shape \(1, 6\), but"),
        ({"starts": [Pose(0.0, 0.0, 0.0)] * 2, "joints": np.zeros((2, 1))}, r"joints .* need \(2, 0\)"),
        ({"starts": [Pose(0.0, 0.0, 0.0)] * 2, "commands": np.zeros(3)}, r"commands .* need \(2, 3\)"),
    ],
)
def test_a_call_of_begin_with_other_shapes_is_a_mistake_of_the_environment(robot, given, message):
    """The simulator would refuse the bytes, and its restarts would end the run with a count of bytes."""
    with pytest.raises(ConfigurationError, match=message):
        BatchedScene(robot).begin(np.arange(2), (1, 2), **given)


def test_a_robot_with_its_own_batched_form_gets_it():
    """The shipped form does not call `Slow.drive`, so such a class needs a batched form of its own."""

    class Slow(Robotino):
        batched = BatchedJointRobot

        def drive(self, vx, vy, omega):
            """Drive at half the speed."""

    assert batched_form(Slow) is BatchedJointRobot
