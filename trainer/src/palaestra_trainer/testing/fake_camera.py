"""Compute camera images of a `FakeRobotino`, with the target's pole, cylinders, walls and floor.

All objects stand upright on the floor. So each column of pixels looks in one direction over the floor, and
the distance to each object is computed once per column. A pixel shows the nearest object that its ray hits
between foot and top. Unlike in a simulator that renders, colors have neither light, shadow nor noise. Camera,
pole and colors are those of the shipped world `seeing`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palaestra_trainer.robots.geometry import Point, Pose
from palaestra_trainer.testing.fake_scene import CYLINDER_HEIGHT_M, CYLINDER_RADIUS_M, HALF_SIDE_M

HEIGHT, WIDTH = 48, 64  # pixels
FIELD_OF_VIEW_RAD = 1.0472  # horizontal
FORWARD_M, ABOVE_M = 0.23, 0.3  # position of the camera, relative to the robot's center and above the floor
RANGE_M = (0.05, 6.0)  # range of the depth camera
POLE_HEIGHT_M, POLE_RADIUS_M = 0.5, 0.05
WALL_HEIGHT_M = 0.3

SKY, FLOOR, WALL = (191, 209, 230), (217, 217, 209), (153, 140, 128)
POLE, CYLINDER = (217, 26, 26), (51, 89, 179)

Colors = NDArray[np.uint8]
Depths = NDArray[np.float32]
_Row = NDArray[np.floating[Any]]

# The direction of each pixel's ray, per meter forward: meters to the left for each column, and meters up for
# each row.
_FOCAL = 0.5 * WIDTH / math.tan(0.5 * FIELD_OF_VIEW_RAD)  # pixels
_LEFT: _Row = (0.5 * WIDTH - 0.5 - np.arange(WIDTH)) / _FOCAL
_UP: _Row = (0.5 * HEIGHT - 0.5 - np.arange(HEIGHT))[:, None] / _FOCAL
_FLOOR_M: _Row = np.where(_UP < 0.0, ABOVE_M / np.maximum(-_UP, 1e-9), math.inf)


@dataclass(frozen=True, slots=True)
class _Thing:
    """An object in an image: for each column the meters forward to the object, its height and its color."""

    forward_m: _Row
    height_m: float
    color: tuple[int, int, int]


def look(pose: Pose, target: Point, cylinders: Sequence[Point]) -> tuple[Colors, Depths]:
    """Return new arrays with the color image and the depth image of a robot at `pose`.

    The color image is RGB of shape (48, 64, 3). The depth image has shape (48, 64) and holds meters forward,
    infinite out of range.
    """
    depths = np.repeat(_FLOOR_M, WIDTH, axis=1)
    colors = np.empty((HEIGHT, WIDTH, 3), np.uint8)
    colors[:] = np.where(_UP < 0.0, np.array(FLOOR, np.uint8), np.array(SKY, np.uint8))[:, None]
    for thing in _things(pose, target, cylinders):
        top_m = ABOVE_M + _UP * thing.forward_m  # infinite, and so invisible, in columns next to the object
        seen = (thing.forward_m < depths) & (top_m >= 0.0) & (top_m <= thing.height_m)
        np.copyto(depths, thing.forward_m, where=seen)
        colors[seen] = thing.color
    depths[(depths < RANGE_M[0]) | (depths > RANGE_M[1])] = math.inf
    return colors, depths.astype(np.float32)


def _things(pose: Pose, target: Point, cylinders: Sequence[Point]) -> Iterator[_Thing]:
    c, s = math.cos(pose.heading_rad), math.sin(pose.heading_rad)
    origin = pose.x_m + FORWARD_M * c, pose.y_m + FORWARD_M * s
    ways = c - s * _LEFT, s + c * _LEFT  # x and y of the rays of each column, per meter forward
    walls = np.minimum(_to_wall(origin[0], ways[0]), _to_wall(origin[1], ways[1]))
    yield _Thing(walls, WALL_HEIGHT_M, WALL)
    for x, y in cylinders:
        yield _Thing(
            _to_circle((x - origin[0], y - origin[1]), ways, CYLINDER_RADIUS_M), CYLINDER_HEIGHT_M, CYLINDER
        )
    pole = target[0] - origin[0], target[1] - origin[1]
    yield _Thing(_to_circle(pole, ways, POLE_RADIUS_M), POLE_HEIGHT_M, POLE)


def _to_wall(position_m: float, way: _Row) -> _Row:
    """Return, for each column, the meters forward to the wall that the column faces."""
    away = np.copysign(np.maximum(np.abs(way), 1e-9), way)
    wall: _Row = (np.copysign(HALF_SIDE_M, way) - position_m) / away
    return wall


def _to_circle(middle: Point, ways: tuple[_Row, _Row], radius_m: float) -> _Row:
    """Return, for each column, the meters forward to a circle on the floor; infinite without a hit."""
    x, y = ways
    squared = x**2 + y**2
    along = (middle[0] * x + middle[1] * y) / squared
    inside = radius_m**2 / squared - (middle[0] ** 2 + middle[1] ** 2) / squared + along**2
    near = along - np.sqrt(np.maximum(inside, 0.0))
    return np.where((inside > 0.0) & (near > 0.0), near, math.inf)
