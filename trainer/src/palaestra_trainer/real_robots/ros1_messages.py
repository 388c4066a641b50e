"""The messages of a Robotino's driver for ROS 1, as readings.

Source: robotino-ros-pkg. The messages are data of another program, so each is checked before it is used.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from palaestra_trainer.errors import LinkError
from palaestra_trainer.real_robots.frames import wrapped
from palaestra_trainer.real_robots.readings import Odometry
from palaestra_trainer.real_robots.sensor_layout import SensorLayout
from palaestra_trainer.robots.base import SENSORS
from palaestra_trainer.robots.geometry import Pose, Twist

_RADIUS_M: Final = 0.2  # from the robot's center to a sensor; the driver adds it to each distance
_UNIT_SLACK: Final = 0.01  # largest difference between the length of a quaternion and 1


def odometry_of(message: Any) -> Odometry:
    """Return the odometry in a nav_msgs/Odometry.

    Raises:
        LinkError: a number is not finite, or the orientation is not a rotation.
    """
    position, turn = message.pose.pose.position, message.pose.pose.orientation
    linear, angular = message.twist.twist.linear, message.twist.twist.angular
    velocity = (linear.x, linear.y, angular.z)
    rotation = (turn.x, turn.y, turn.z, turn.w)
    if not all(map(math.isfinite, (position.x, position.y, *velocity, *rotation))):
        raise LinkError(f"odom: {position} and {velocity} are not finite, which a Robotino does not send")
    if abs(math.hypot(*rotation) - 1.0) > _UNIT_SLACK:
        raise LinkError(f"odom: the orientation {rotation} is not a rotation, which a Robotino does not send")
    heading = math.atan2(
        2.0 * (turn.w * turn.z + turn.x * turn.y), 1.0 - 2.0 * (turn.y * turn.y + turn.z * turn.z)
    )
    return Odometry(Pose(position.x, position.y, wrapped(heading)), velocity)


def distances_of(message: Any, layout: SensorLayout) -> NDArray[np.float32]:
    """Return the distances in a sensor_msgs/PointCloud of the driver, converted by `layout`.

    Args:
        message: the point of each sensor's obstacle, in the frame of the robot.
        layout: the order of the sensors; its unit must be meters.

    Raises:
        LinkError: the message does not have nine finite points.
    """
    distances_m = [math.hypot(point.x, point.y) - _RADIUS_M for point in message.points]
    if len(distances_m) != SENSORS or not all(map(math.isfinite, distances_m)):
        raise LinkError(f"distance_sensors: {distances_m} are not {SENSORS} distances of a Robotino")
    return layout.meters_of(distances_m)


def fields_of(twist: Twist) -> dict[str, dict[str, float]]:
    """Return the fields of the geometry_msgs/Twist that commands a velocity."""
    forward, left, turning = twist
    return {"linear": {"x": forward, "y": left}, "angular": {"z": turning}}
