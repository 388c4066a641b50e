"""The definitions of ROS 2's message types, as the text that an MCAP file contains for each type.

Most types have the same fields in ROS 1 and ROS 2, so their texts are those of `palaestra_protocol.ros`. This
module adds the types that differ.
Source: https://github.com/ros2/common_interfaces, https://github.com/ros2/rcl_interfaces and
https://github.com/ros2/geometry2, branches humble to jazzy
"""

from __future__ import annotations

from functools import cache
from typing import Final

from palaestra_protocol.ros import definitions
from palaestra_protocol.ros.syntax import BUILT_IN, parse

BOOL: Final = "std_msgs/msg/Bool"
FLOATS: Final = "std_msgs/msg/Float32MultiArray"
IMAGE: Final = "sensor_msgs/msg/Image"
LASER_SCAN: Final = "sensor_msgs/msg/LaserScan"
ODOMETRY: Final = "nav_msgs/msg/Odometry"
POSE: Final = "geometry_msgs/msg/PoseStamped"
STRING: Final = "std_msgs/msg/String"
TRANSFORMS: Final = "tf2_msgs/msg/TFMessage"
TWIST: Final = "geometry_msgs/msg/Twist"
TYPES: Final = (BOOL, FLOATS, IMAGE, LASER_SCAN, ODOMETRY, POSE, STRING, TRANSFORMS, TWIST)

# Types that ROS 1 lacks, or that have other fields there.
_OF_ROS_2 = {
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec\n",
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id\n",
    "tf2_msgs/TFMessage": "geometry_msgs/TransformStamped[] transforms\n",
}
_SEPARATOR = "=" * 80  # Source: https://mcap.dev/spec/registry#ros2msg


@cache
def definition(type_name: str) -> str:
    """Return the definition of a type and, after it, of all types that it contains.

    The format is `ros2msg` of MCAP: a line of `=` and a line `MSG: package/Name` come before each contained
    type.

    Args:
        type_name: one of `TYPES`, such as `nav_msgs/msg/Odometry`.

    Raises:
        KeyError: the type is not one of `TYPES`.
    """
    if type_name not in TYPES:
        raise KeyError(type_name)
    name = type_name.replace("/msg/", "/")
    contained = _contained(name)
    return _text(name) + "".join(f"{_SEPARATOR}\nMSG: {part}\n{_text(part)}" for part in contained)


def _contained(name: str) -> list[str]:
    """Return the names of all types in a type, at any depth, each once."""
    found: dict[str, None] = {}
    open_ = [name]
    while open_:
        current = open_.pop()
        parts = [field.type for field in parse(current, _text(current)).fields if field.type not in BUILT_IN]
        open_.extend(part for part in parts if part not in found)
        found.update(dict.fromkeys(parts))
    return list(found)


def _text(name: str) -> str:
    return _OF_ROS_2[name] if name in _OF_ROS_2 else definitions.text(name)
