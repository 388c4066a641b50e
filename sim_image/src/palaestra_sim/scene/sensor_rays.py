"""Beams: the rays of sensors, before they are cast, in the frame of the robot that carries the sensors."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from palaestra_sim.scene.geometry import Pose, Vector, turn

# A ray in a robot's frame: x and y of its origin in meters, x and y of its unit direction.
Ray = tuple[float, float, float, float]

_LEVEL: Final = 1e-3  # a smaller slope counts as level
_STEEPEST: Final = 1e-6  # a vertical ray moves less than this along the floor for each meter of its length


class Beam(NamedTuple):
    """A ray that may point up or down: its trace on the floor, its height, and its slope.

    Attributes:
        ray: the ray as seen from above, in the robot's frame.
        height_m: the height of the ray's origin, in the robot's frame.
        slope: the height that the ray gains for each meter along the floor.
        reach_m: the distance beyond which the sensor's value is constant.
    """

    ray: Ray
    height_m: float
    slope: float
    reach_m: float

    @property
    def level(self) -> bool:
        """Whether the height of the beam is constant."""
        return self.slope == 0.0

    def seen_from(self, pose: Pose) -> Beam:
        """Return the same beam in the outer frame, in which the robot's frame has `pose`."""
        x, y, along_x, along_y = self.ray
        origin = pose.carry((x, y, self.height_m))
        return beam_along(Pose(origin, pose.rotation), (along_x, along_y, self.slope), self.reach_m)


def beam_along(pose: Pose, direction: Vector, reach_m: float) -> Beam:
    """Return the beam that starts at the origin of a frame, in a direction of this frame."""
    dx, dy, dz = turn(pose.rotation, direction)
    along = math.hypot(dx, dy)
    # A vertical beam may have any direction along the floor. A direction computed from rounding errors would
    # not have the length 1.
    if along < _STEEPEST:
        dx, dy, along = _STEEPEST, 0.0, _STEEPEST
    slope = dz / along
    ray = pose.position[0], pose.position[1], dx / along, dy / along
    return Beam(ray, pose.position[2], slope if abs(slope) > _LEVEL else 0.0, reach_m)
