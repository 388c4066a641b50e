"""The test picture shows one red pole at the origin of the world, as far as the pose allows."""

import io
import math

import numpy as np
import pytest
from PIL import Image

from palaestra_sim.mock_robot.camera import picture


def red_columns(*pose):
    """Return the columns of the picture that show the pole at half of its height."""
    pixels = np.asarray(Image.open(io.BytesIO(picture(*pose))), int)
    assert pixels.shape == (240, 320, 3)
    return np.flatnonzero(pixels[119, :, 0] - pixels[119, :, 1] > 90)


def test_the_pole_is_where_the_pose_says():
    """A pole ahead is in the middle. It moves to the right if the robot turns left, and is wider nearby."""
    ahead, turned, near = red_columns(-2, 0, 0), red_columns(-2, 0, 0.2), red_columns(-1, 0, 0)

    assert ahead.mean() == pytest.approx(159.5, abs=1.0)
    assert turned.mean() == pytest.approx(159.5 + 277.0 * math.tan(0.2), abs=2.0)
    assert len(near) == pytest.approx(2 * len(ahead), abs=4)


def test_behind_the_robot_nothing_is_seen():
    """A camera sees only forward."""
    assert red_columns(2, 0, 0).size == 0
