"""Poses of odometry in the frame of a task.

The odometry of a robot begins at any pose, and REST has no request that resets it. So an `OdometryFrame`
shifts the odometry. It maps the pose that the robot reported at the start to the pose where a person placed
the robot.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

from palaestra_trainer.robots.geometry import Point, Pose, Twist


@dataclass(frozen=True, slots=True)
class OdometryFrame:
    """The origin of odometry, as a pose in the frame of the task."""

    origin: Pose

    @classmethod
    def through(cls, reported: Pose, known: Pose) -> Self:
        """Return the frame that maps the odometry `reported` to the pose `known`."""
        turned = known.heading_rad - reported.heading_rad
        x_m, y_m = _rotated(turned, reported.x_m, reported.y_m)
        return cls(Pose(known.x_m - x_m, known.y_m - y_m, wrapped(turned)))

    def of_task(self, reported: Pose) -> Pose:
        """Return a pose of odometry in the frame of the task."""
        x_m, y_m = _rotated(self.origin.heading_rad, reported.x_m, reported.y_m)
        heading = wrapped(self.origin.heading_rad + reported.heading_rad)
        return Pose(self.origin.x_m + x_m, self.origin.y_m + y_m, heading)


def extrapolated(pose: Pose, velocity: Twist, seconds: float) -> Pose:
    """Return the pose after some seconds at a constant velocity in the robot's frame (m/s, m/s, rad/s)."""
    forward, left, turning = velocity
    x_m, y_m = _rotated(pose.heading_rad + 0.5 * turning * seconds, forward * seconds, left * seconds)
    return Pose(pose.x_m + x_m, pose.y_m + y_m, wrapped(pose.heading_rad + turning * seconds))


def wrapped(angle_rad: float) -> float:
    """Return an angle in (-pi, pi]."""
    rest = math.remainder(angle_rad, 2.0 * math.pi)
    return math.pi if rest == -math.pi else rest


def _rotated(angle_rad: float, x_m: float, y_m: float) -> Point:
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return x_m * c - y_m * s, x_m * s + y_m * c
