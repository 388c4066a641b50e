"""The scan of a Robotino's distance sensors in ROS 2, as a reading.

The function reads only fields, so it accepts any object with the fields of the message. Source of the facts:
the node rto_node of robocup-logistics/ros2-robotino. The other messages of this node are those of the driver
for ROS 1.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from palaestra_trainer.errors import LinkError
from palaestra_trainer.real_robots.sensor_layout import SensorLayout
from palaestra_trainer.robots.base import SENSORS

_STEP_RAD: Final = 2.0 * math.pi / SENSORS
_ASKEW_RAD: Final = 0.05
# A scan has one origin, the center of the robot. So the driver adds this radius to each sensor's distance.
_RADIUS_M: Final = 0.225


def distances_of(message: Any, layout: SensorLayout) -> NDArray[np.float32]:
    """Return the distances in a sensor_msgs/msg/LaserScan, converted by `layout`.

    Args:
        message: a ray for each sensor, from the center of the robot. The angle of a ray identifies its
            sensor. The range of a ray without an obstacle may be infinite.
        layout: the order of the sensors; its unit must be meters.

    Raises:
        LinkError: the rays are not those of the sensors, or a range is not a number.
    """
    ranges_m = list(message.ranges)
    first, step = message.angle_min, message.angle_increment
    if len(ranges_m) != SENSORS or not math.isfinite(first + step) or any(map(math.isnan, ranges_m)):
        raise LinkError(
            f"irsensor_scan: {ranges_m} are not {SENSORS} ranges, so the scan is not from a Robotino"
        )
    distances_m = dict[int, float]()
    for ray, range_m in enumerate(ranges_m):
        angle = first + ray * step
        sensor = round(angle / _STEP_RAD)
        if abs(angle - sensor * _STEP_RAD) > _ASKEW_RAD:
            raise LinkError(f"irsensor_scan: a ray has {angle:.2f} rad, where a Robotino has no sensor")
        distances_m[sensor % SENSORS] = range_m - _RADIUS_M
    if len(distances_m) != SENSORS:
        raise LinkError("irsensor_scan: two rays have the same angle, so the scan is not from a Robotino")
    return layout.meters_of([distances_m[sensor] for sensor in range(SENSORS)])
