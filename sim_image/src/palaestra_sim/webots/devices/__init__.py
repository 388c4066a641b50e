"""The devices of a robot in Webots: one table, with the maker of each type of device.

- `calls`: the functions of one device, and the common parts of all devices
- `sensors`: sensors with one value or one vector
- `cameras`, `lidar`, `radar`: sensors with pictures, layers or targets
- `actuators`: devices that a client commands
- `display`, `radio`: displays, emitters and receivers
- `inputs`: battery, keyboard and joystick
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping
from typing import Final

from palaestra_sim.ros_controller.served_robot import ServedDevice
from palaestra_sim.ros_interfaces import is_ros_name, topic_name
from palaestra_sim.scene.nodes.types import type_number
from palaestra_sim.webots.devices import actuators, cameras, display, lidar, radar, radio, sensors
from palaestra_sim.webots.devices.calls import DeviceCalls
from palaestra_sim.webots.library import Library

log = logging.getLogger(__name__)

_Maker = Callable[[DeviceCalls], ServedDevice]

# For each type of node, the part of the functions' names that names the type, and the maker of the device.
_MAKERS: Final[Mapping[str, tuple[str, _Maker]]] = {
    "Accelerometer": ("accelerometer", sensors.accelerometer),
    "Altimeter": ("altimeter", sensors.altimeter),
    "Brake": ("brake", actuators.brake),
    "Camera": ("camera", cameras.camera),
    "Compass": ("compass", sensors.compass),
    "Connector": ("connector", actuators.connector),
    "Display": ("display", display.display),
    "DistanceSensor": ("distance_sensor", sensors.distance_sensor),
    "Emitter": ("emitter", radio.emitter),
    "GPS": ("gps", sensors.gps),
    "Gyro": ("gyro", sensors.gyro),
    "InertialUnit": ("inertial_unit", sensors.inertial_unit),
    "LED": ("led", actuators.led),
    "Lidar": ("lidar", lidar.lidar),
    "LightSensor": ("light_sensor", sensors.light_sensor),
    "LinearMotor": ("motor", actuators.linear_motor),
    "Pen": ("pen", actuators.pen),
    "PositionSensor": ("position_sensor", sensors.position_sensor),
    "Radar": ("radar", radar.radar),
    "RangeFinder": ("range_finder", cameras.range_finder),
    "Receiver": ("receiver", radio.receiver),
    "RotationalMotor": ("motor", actuators.rotational_motor),
    "Skin": ("skin", actuators.skin),
    "Speaker": ("speaker", actuators.speaker),
    "TouchSensor": ("touch_sensor", sensors.touch_sensor),
    "VacuumGripper": ("vacuum_gripper", actuators.vacuum_gripper),
}
_BY_NUMBER: Final = {type_number(node): maker for node, maker in _MAKERS.items()}


def names(library: Library) -> list[str]:
    """Return the names of all devices of the robot."""
    return [library.device_get_name(tag) for tag in _tags(library)]


def devices(library: Library) -> Iterator[ServedDevice]:
    """Yield the devices of the robot; log the devices that the controller cannot offer."""
    paths: set[str] = set()
    for tag in _tags(library):
        name, number = library.device_get_name(tag), library.device_get_node_type(tag)
        path = topic_name(name)
        if number not in _BY_NUMBER:
            log.warning("the device %r is of a type that ROS clients cannot use; it is left out", name)
        elif not is_ros_name(name):
            log.warning("the device %r is left out, because ROS does not accept its name; rename it", name)
        elif path in paths:
            log.warning(
                "the device %r is left out, because another device has the path %s; rename it",
                name,
                path,
            )
        else:
            paths.add(path)
            kind, make = _BY_NUMBER[number]
            yield make(DeviceCalls(library, kind, tag))


def _tags(library: Library) -> Iterator[int]:
    for index in range(library.robot_get_number_of_devices()):
        yield library.robot_get_device_by_index(index)
