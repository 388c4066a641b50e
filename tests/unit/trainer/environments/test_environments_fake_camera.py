"""The images of the fake's cameras are compared with geometry that was computed by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from palaestra_sim.world import builtin, parse
from palaestra_trainer.robots import Pose
from palaestra_trainer.testing import fake_camera, fake_seeing
from palaestra_trainer.testing.fake_camera import CYLINDER, FLOOR, POLE, SKY, WALL

MIDDLE = fake_camera.WIDTH // 2


@pytest.fixture
def look():
    """`look(pose, target)` returns the color image and the depth image, with cylinders if requested."""
    robot, scene = fake_seeing()
    robot.use_cameras(color=True, depth=True)

    def images(pose, target, *, cylinders=False):
        scene.reset(0, pose, target)
        if cylinders:
            for thing in scene.layout().obstacles:
                scene.put(thing.name, (thing.x_m, thing.y_m, 0.2))
        return robot.color_image(), robot.depth_image()

    return images


def columns(colors, color):
    """Return the image columns that contain a pixel of a color."""
    return np.flatnonzero((colors == np.array(color)).all(axis=2).any(axis=0))


def rows(colors, color):
    """Return the image rows that contain a pixel of a color."""
    return np.flatnonzero((colors == np.array(color)).all(axis=2).any(axis=1))


def test_a_pole_straight_ahead_is_in_the_middle_at_its_distance(look):
    """The distance is from the camera to the front of the pole. The pole is higher than the wall."""
    colors, depths = look(Pose(0.0, 0.0, 0.0), (1.0, 0.0))

    seen = columns(colors, POLE)
    assert seen.mean() == pytest.approx(MIDDLE - 0.5)
    assert depths[24, MIDDLE] == pytest.approx(1.0 - 0.23 - 0.05, abs=0.002)
    assert rows(colors, POLE).min() < rows(colors, WALL).min()


@pytest.mark.parametrize(("left", "heading_rad"), [(0.3, 0.0), (0.0, -0.3)])
def test_what_is_on_the_left_is_left_in_the_image(look, left, heading_rad):
    """The pole is moved to the left, or the robot is turned to the right."""
    colors, _ = look(Pose(0.0, 0.0, heading_rad), (1.0, left))

    assert len(columns(colors, POLE)) > 0
    assert columns(colors, POLE).max() < MIDDLE


def test_the_pole_fills_more_of_the_image_as_it_comes_nearer(look):
    """A policy can estimate the distance from the size of the pole."""
    widths = [len(columns(look(Pose(0.0, 0.0, 0.0), (x, 0.0))[0], POLE)) for x in (1.6, 0.8, 0.5)]

    assert widths == sorted(set(widths))


def test_the_pole_leaves_the_image_above_and_below_when_it_is_reached(look):
    """At a distance of 0.45 m, the top and the foot of the pole are outside the image."""
    colors, _ = look(Pose(0.0, 0.0, 0.0), (0.45, 0.0))

    assert len(rows(colors, POLE)) == fake_camera.HEIGHT


def test_a_pole_beside_or_behind_the_robot_is_not_seen(look):
    """The camera has a field of view of 60 degrees."""
    for target in ((0.0, 1.0), (-1.0, 0.0), (0.5, -1.0)):
        colors, _ = look(Pose(0.0, 0.0, 0.0), target)

        assert len(columns(colors, POLE)) == 0


def test_a_cylinder_hides_what_is_behind_it(look):
    """The upper part of the pole is visible above the cylinder."""
    colors, depths = look(Pose(0.0, 0.8, 0.0), (1.6, 0.8), cylinders=True)

    assert tuple(colors[24, MIDDLE]) == CYLINDER
    assert depths[24, MIDDLE] == pytest.approx(0.8 - 0.25 - 0.23, abs=0.002)
    assert len(columns(look(Pose(0.0, 0.8, 0.0), (1.6, 0.8))[0], CYLINDER)) == 0


def test_walls_hide_the_floor_behind_them_and_the_sky_is_infinitely_far(look):
    """The wall is as high as the camera, so the upper edge of the wall is in the middle of the image."""
    colors, depths = look(Pose(0.0, 0.0, 0.0), (-1.0, 0.0))

    assert [tuple(colors[row, 0]) for row in (0, 23, 24, -1)] == [SKY, SKY, WALL, FLOOR]
    assert depths[24, 0] == pytest.approx(2.0 - 0.23, abs=0.002)
    assert math.isinf(depths[0, 0])


def test_a_reset_takes_the_cylinders_away_again(look):
    """The world file has the cylinders below the floor, and a reset puts them there."""
    look(Pose(0.0, 0.8, 0.0), (1.6, 0.8), cylinders=True)

    colors, _ = look(Pose(0.0, 0.8, 0.0), (1.6, 0.8))

    assert len(columns(colors, CYLINDER)) == 0


def test_the_cameras_are_those_of_the_shipped_world():
    """A policy that was trained on the fake must see the same pole in the same place in the simulator."""
    nodes = list(parse(builtin("seeing")).walk())
    (camera,) = [node for node in nodes if node.type_name == "Camera"]
    (depth_camera,) = [node for node in nodes if node.type_name == "RangeFinder"]
    (target,) = [node for node in nodes if node.def_name == "TARGET"]
    (pole,) = target.nodes("children")[0].nodes("geometry")
    (paint,) = target.nodes("children")[0].nodes("appearance")

    assert camera.numbers("translation") == (fake_camera.FORWARD_M, 0, fake_camera.ABOVE_M)
    assert camera.numbers("fieldOfView") == (fake_camera.FIELD_OF_VIEW_RAD,)
    assert (camera.numbers("width"), camera.numbers("height")) == (
        (fake_camera.WIDTH,),
        (fake_camera.HEIGHT,),
    )
    assert (depth_camera.numbers("minRange"), depth_camera.numbers("maxRange")) == tuple(
        (limit,) for limit in fake_camera.RANGE_M
    )
    assert pole.numbers("radius") == (fake_camera.POLE_RADIUS_M,)
    assert pole.numbers("height") == (fake_camera.POLE_HEIGHT_M,)
    assert [round(255 * part) for part in paint.numbers("baseColor") or ()] == list(POLE)
