"""Poses and movements on a floor, in meters of the world's frame and radians counter-clockwise from x."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

SPEED_M_S = 0.5  # Source: ~max_linear_vel in the launch file of robotino_node
TURN_RAD_S = 1.0  # Source: default of ~max_angular_vel in robotino_node

Twist = tuple[float, float, float]
Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Pose:
    """Position of a robot in meters of the world's frame, and heading in (-pi, pi], 0 along x."""

    x_m: float
    y_m: float
    heading_rad: float


class Movement(IntEnum):
    """The discrete movements of a Robotino, each for one control period."""

    STOP = 0
    FORWARD = 1
    BACKWARD = 2
    LEFT = 3
    RIGHT = 4
    TURN_LEFT = 5
    TURN_RIGHT = 6

    @property
    def twist(self) -> Twist:
        """The velocities of the movement, as arguments of `Omnidrive.drive`."""
        return _TWISTS[self.value]


# The index is the number of the movement.
_TWISTS: tuple[Twist, ...] = (
    (0.0, 0.0, 0.0),
    (SPEED_M_S, 0.0, 0.0),
    (-SPEED_M_S, 0.0, 0.0),
    (0.0, SPEED_M_S, 0.0),
    (0.0, -SPEED_M_S, 0.0),
    (0.0, 0.0, TURN_RAD_S),
    (0.0, 0.0, -TURN_RAD_S),
)
