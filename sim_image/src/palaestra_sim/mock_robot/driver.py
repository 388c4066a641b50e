"""The habits of a Robotino's driver for ROS 1, `robotino_node`, as a pure function of its inputs.

The driver's loop runs 30 times a second. The driver forwards each command once, up to one period late. It has
no watchdog: without a new command it forwards nothing, so the base's own dead man's switch stops the robot.
Between two periods, only the newest command is kept. Source: OmniDriveROS.cpp and RobotinoNode.cpp of
robotino-ros-pkg. The driver was not measured on a robot.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from palaestra_sim.scene.wheel_kinematics import Twist

PERIOD_S: Final = 1.0 / 30.0
_RADIUS_M: Final = 0.2  # from the center of the robot to each distance sensor, as the driver assumes
_HEIGHT_M: Final = 0.05
_BETWEEN_RAD: Final = math.radians(40.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """The private parameters of the driver; the defaults are those of the driver.

    Attributes:
        max_linear_vel: greatest speed along x and along y, in m/s; a faster command is clipped.
        min_linear_vel: least speed along x and along y, in m/s; a slower command is raised.
        max_angular_vel: greatest rate of turning, in rad/s.
        min_angular_vel: least rate of turning, in rad/s.
    """

    max_linear_vel: float = 0.2
    min_linear_vel: float = 0.05
    max_angular_vel: float = 1.0
    min_angular_vel: float = 0.1

    def within(self, command: Twist) -> Twist:
        """Return the command with the speed of each axis clipped or raised separately; 0 stays 0."""
        vx, vy, omega = command
        return (
            _within(vx, self.min_linear_vel, self.max_linear_vel),
            _within(vy, self.min_linear_vel, self.max_linear_vel),
            _within(omega, self.min_angular_vel, self.max_angular_vel),
        )


class CommandSlot:
    """Holds the newest command until the next period of the driver.

    Args:
        limits: the limits of the commands.
    """

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._command: Twist | None = None

    def put(self, command: Twist) -> None:
        """Keep a command, in place of an older command: vx, vy in m/s and omega in rad/s."""
        self._command = command

    def take(self) -> Twist | None:
        """Return the command to forward now, within the limits; None if no new command has arrived."""
        command, self._command = self._command, None
        return None if command is None else self._limits.within(command)


def points(distances_m: Sequence[float]) -> list[tuple[float, float, float]]:
    """Return the nearest obstacles as points x, y, z in meters, in the frame of the robot."""
    return [
        (
            (distance_m + _RADIUS_M) * math.cos(number * _BETWEEN_RAD),
            (distance_m + _RADIUS_M) * math.sin(number * _BETWEEN_RAD),
            _HEIGHT_M,
        )
        for number, distance_m in enumerate(distances_m)
    ]


def _within(speed: float, least: float, most: float) -> float:
    if abs(speed) > most:
        return math.copysign(most, speed)
    if 0.0 < abs(speed) < least:
        return math.copysign(least, speed)
    return speed
