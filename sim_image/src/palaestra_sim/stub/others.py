"""The surfaces of robots at their current positions, for the sensor rays of other robots."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Pose, Vector
from palaestra_sim.scene.hits import first_hit
from palaestra_sim.scene.shapes import Shape
from palaestra_sim.stub.body import StubBody

_ALONG: Final = 1.0 - 0.5e-6  # minimum z of a unit vector that counts as vertical


class OtherRobot:
    """A robot that rays of other robots can hit.

    Args:
        body: the body of the robot, which has the current position and heading.
        place: the frame of the robot; only its height is used.
        parts: the shapes of the robot's outline, each with the pose of the robot in the frame of the shape.
    """

    __slots__ = ("_body", "_parts", "_place", "_radius_m")

    def __init__(self, body: StubBody, place: Frame, parts: Sequence[tuple[Shape, Pose]]) -> None:
        self._body = body
        self._place = place
        self._parts = tuple(parts)
        self._radius_m = max((_reach(shape, inward) for shape, inward in parts), default=0.0)

    def stands_along(self, low_m: float, high_m: float) -> bool:
        """Return whether all parts of the robot are upright cylinders that span the given heights.

        Level rays between the two heights then meet the robot as they meet its discs.
        """
        height = self._place.height_m
        return all(
            shape.kind == "cylinder" and abs(inward.rotation[8]) > _ALONG and low < low_m and high_m < high
            for shape, inward in self._parts
            for low, high in [_heights(shape, inward, height)]
        )

    def hit(self, origin: Vector, direction: Vector) -> float:
        """Return the distance in meters from `origin` to the robot along the unit vector `direction`.

        Both arguments are in the axes of the ground. The distance is infinite if the ray misses the robot.
        """
        body = self._body
        dx, dy = origin[0] - body.x, origin[1] - body.y
        ux, uy, uz = direction
        if abs(dx * uy - dy * ux) > self._radius_m * math.hypot(ux, uy) and (ux or uy):
            return math.inf
        c, s = body.c, body.s
        start = dx * c + dy * s, dy * c - dx * s, origin[2] - self._place.height_m
        way = ux * c + uy * s, uy * c - ux * s, uz
        return min(
            (first_hit(shape, inward.carry(start), inward.turned(way)) for shape, inward in self._parts),
            default=math.inf,
        )


def _heights(shape: Shape, inward: Pose, height_m: float) -> tuple[float, float]:
    """Return z of the lower and the upper end of a part of a robot whose frame is at `height_m`."""
    pose = inward.inverse
    middle, half = pose.position[2] + height_m, shape.half_along(pose.rotation, 2)
    return middle - half, middle + half


def _reach(shape: Shape, inward: Pose) -> float:
    """Return the radius of a circle around the robot's origin that contains all of a shape."""
    x, y, _ = inward.inverse.position
    return math.hypot(x, y) + math.hypot(*shape.size) / 2.0
