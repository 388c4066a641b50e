"""The interface of a robot, and the meaning of its movements."""

from __future__ import annotations

import numpy as np
import pytest

from palaestra_trainer.errors import ConfigurationError, MissingCapability, NoSuchSensor
from palaestra_trainer.robots import Cameras, Joints, Localization, Movement, require
from palaestra_trainer.testing import FakeRobotino, FakeSeeingRobotino


@pytest.mark.parametrize(
    ("movement", "other"),
    [
        (Movement.FORWARD, Movement.BACKWARD),
        (Movement.LEFT, Movement.RIGHT),
        (Movement.TURN_LEFT, Movement.TURN_RIGHT),
    ],
)
def test_movements_come_in_opposite_pairs(movement, other):
    """A robot that drove one way can drive the same way back."""
    assert np.add(movement.twist, other.twist).tolist() == [0.0, 0.0, 0.0]
    assert np.any(movement.twist)


def test_stop_is_the_movement_that_asks_for_nothing():
    """STOP is action 0, so an untrained policy with equal values for all actions stands still."""
    assert Movement.STOP == 0
    assert Movement.STOP.twist == (0.0, 0.0, 0.0)


def test_a_movement_drives_at_its_twist():
    """`move(movement)` is `drive` with the velocities of the movement."""
    moving, driving = FakeRobotino(), FakeRobotino()

    moving.move(Movement.LEFT)
    driving.drive(*Movement.LEFT.twist)
    moving.advance()
    driving.advance()

    assert moving.pose() == driving.pose()


def test_a_refusal_names_the_robot_the_task_and_what_is_missing():
    """The message also lists the devices that the robot has, so the author can choose another task."""
    with pytest.raises(MissingCapability) as refusal:
        require(FakeRobotino(), (Localization, Cameras, Joints), "Sorting-v0")

    assert str(refusal.value) == (
        "trainer.robot: FakeRobotino has no Cameras and no Joints, which Sorting-v0 needs; it has Steering, "
        "Omnidrive, Localization, Distances, Bumper. Use another robot or another task"
    )


def test_a_refusal_is_a_mistake_of_the_configuration_and_about_a_sensor():
    """A retry cannot help, so the error is one of the configuration.

    Code that catches the older class for errors of cameras still works.
    """
    assert issubclass(MissingCapability, ConfigurationError)
    assert issubclass(MissingCapability, NoSuchSensor)


def test_a_robot_that_drives_in_every_direction_steers_too():
    """A task for two wheels therefore works with a Robotino too."""
    steered, driven = FakeRobotino(), FakeRobotino()

    steered.steer(0.3, 0.5)
    driven.drive(0.3, 0.0, 0.5)
    steered.advance()
    driven.advance()

    assert steered.pose() == driven.pose()


@pytest.mark.parametrize("camera", ["color", "depth"])
def test_a_camera_that_is_not_in_use_has_no_image(camera):
    """The error has the name of the call that enables the camera."""
    robot = FakeSeeingRobotino()
    robot.use_cameras(**{"depth" if camera == "color" else "color": True})

    with pytest.raises(NoSuchSensor, match=rf"call use_cameras\({camera}=True\), then advance"):
        getattr(robot, f"{camera}_image")()
