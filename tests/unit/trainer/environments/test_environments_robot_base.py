"""The interface of a robot: what its words mean."""

from __future__ import annotations

import numpy as np
import pytest

from palaestra_trainer.errors import NoSuchSensor
from palaestra_trainer.robots import Movement
from palaestra_trainer.testing import FakeRobotino


@pytest.mark.parametrize(
    ("movement", "other"),
    [
        (Movement.FORWARD, Movement.BACKWARD),
        (Movement.LEFT, Movement.RIGHT),
        (Movement.TURN_LEFT, Movement.TURN_RIGHT),
    ],
)
def test_movements_come_in_opposite_pairs(movement, other):
    """A robot that went one way can come back the same way."""
    assert np.add(movement.twist, other.twist).tolist() == [0.0, 0.0, 0.0]
    assert np.any(movement.twist)


def test_stop_is_the_movement_that_asks_for_nothing():
    """Zero is also the first action, so that an untrained argmax over equal values stands still."""
    assert Movement.STOP == 0
    assert Movement.STOP.twist == (0.0, 0.0, 0.0)


def test_a_movement_drives_at_its_twist():
    """`move` is `drive` for those who choose from an enumeration."""
    moving, driving = FakeRobotino(), FakeRobotino()

    moving.move(Movement.LEFT)
    driving.drive(*Movement.LEFT.twist)
    moving.advance()
    driving.advance()

    assert moving.pose() == driving.pose()


@pytest.mark.parametrize("take", ["color_image", "depth_image"])
def test_a_robot_without_cameras_says_so(take):
    """The error is typed, so that a caller can ask whether there is a camera."""
    with pytest.raises(NoSuchSensor, match=r"FakeRobotino has no .* camera; use distances\(\)"):
        getattr(FakeRobotino(), take)()


@pytest.mark.parametrize("camera", ["color", "depth"])
def test_a_robot_without_cameras_lets_none_be_used(camera):
    """Before an episode that would need it."""
    with pytest.raises(NoSuchSensor, match=f"FakeRobotino has no {camera} camera"):
        FakeRobotino().use_cameras(**{camera: True})


@pytest.mark.parametrize("camera", ["color", "depth"])
def test_a_camera_that_is_not_in_use_has_no_image(camera):
    """The error says how to use it."""
    robot = FakeRobotino(cameras=True)
    robot.use_cameras(**{"depth" if camera == "color" else "color": True})

    with pytest.raises(NoSuchSensor, match=rf"call use_cameras\({camera}=True\), then advance"):
        getattr(robot, f"{camera}_image")()
