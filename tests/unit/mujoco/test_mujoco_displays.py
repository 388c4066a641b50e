"""Displays that show the image of a camera behind their own drawings."""

import numpy as np
import pytest

from palaestra_sim.mujoco.physics import MujocoPhysics
from palaestra_sim.ros_interfaces import UnsimulatedError
from palaestra_sim.scene.image_buffer import ImageBuffer
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.simulation import Simulation

WORLD = """#VRML_SIM R2023b utf8
WorldInfo {{ }}
Solid {{ translation 2 0 0 children [ Shape {{
  appearance PBRAppearance {{ baseColor 1 0 0 }} geometry Box {{ size 1 9 9 }} }} ] }}
Robot {{ name "robot" children [
  Camera {{ name "eye" width 16 height 8 }} Display {{ name "screen" {} }} ] }}
"""
SIZE = "width 16 height 8"
WHITE = (255, 255, 255, 255)


@pytest.fixture
def devices():
    """`devices(fields)` returns a camera in front of a red wall, and a display with these fields."""

    def load(fields=SIZE):
        simulation = Simulation.load(WORLD.format(fields).encode(), MujocoPhysics(), "world", Mode.FAST)
        rows = simulation.robots[0].parts.devices.rows
        return rows["eye"][1], rows["screen"][1]

    return load


def test_a_display_shows_the_picture_of_a_camera_behind_what_is_drawn(devices):
    """When a camera is attached, black pixels of the display become transparent.

    Later drawings stay on top.
    """
    camera, display = devices()
    display.picture.draw([(3, 2)], WHITE)

    assert display.attach("eye")
    display.picture.draw([(4, 2)], (0, 0, 0, 255))

    seen = ImageBuffer(width=16, height=8, pixels=bytearray(camera.value))
    shown = display.shown
    assert shown.at(0, 0) == seen.at(0, 0) != (0, 0, 0, 255)
    assert (shown.at(3, 2), shown.at(4, 2)) == (WHITE, (0, 0, 0, 255))


def test_a_display_without_its_camera_is_transparent_where_nothing_was_drawn(devices):
    """Without the camera, Webots also shows only the drawings."""
    _, display = devices()
    display.attach("eye")
    display.picture.draw([(3, 2)], WHITE)

    display.camera = None

    alphas = np.frombuffer(display.shown.pixels, np.uint8)[3::4].reshape(8, 16)
    assert np.argwhere(alphas).tolist() == [[2, 3]]


def test_a_camera_of_another_size_is_not_attached(devices):
    """Webots would read memory outside of the camera's image."""
    _, display = devices("width 8 height 8")

    with pytest.raises(UnsimulatedError, match="give both the same size"):
        display.attach("eye")
