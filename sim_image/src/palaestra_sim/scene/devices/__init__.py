"""The devices of robots: one table, with a row for each type of node.

A row (`DeviceType`) holds everything about one type: how it is read from the world, how its value is sampled,
its services, its topics with their messages, and the rule of its `enable`. The effect of the fault
`wrong_value` follows from the topic. A new device is one file in this package and one line in `DEVICES`;
CONTRIBUTING.md has the steps.

- `kind`: what a row is
- `distance_sensor`, `touch_sensor`: the rows of what feels obstacles
- `motors`, `brake`, `position_sensor`: the rows of joints
- `lidar`: the row of many rays
- `gps`, `compass`, `gyro`, `accelerometer`, `inertial_unit`: the rows of what measures place and motion
- `altimeter`, `light_sensor`: the rows of what measures the surroundings
- `emitter`, `receiver`: the rows of radio
- `connector`: the row of what feels another of its kind
- `led`, `speaker`, `pen`, `display`: rows that only keep what a program sets
- `camera`, `range_finder`: the rows of what sees
- `pictures`, `recognition`: the lens that both have, and the objects that a camera finds
- `radar`: the row of what measures the distances of targets
- `vacuum_gripper`: the row of what would hold things
- `skin`: the row of meshes that move, of which there are none
- `response`: lookup tables, resolution and axes, which several of them have
- `imu`: the topic of those that send a sensor_msgs/Imu
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from palaestra_sim.scene.devices.accelerometer import ACCELEROMETER
from palaestra_sim.scene.devices.altimeter import ALTIMETER
from palaestra_sim.scene.devices.brake import BRAKE
from palaestra_sim.scene.devices.camera import CAMERA
from palaestra_sim.scene.devices.compass import COMPASS
from palaestra_sim.scene.devices.connector import CONNECTOR
from palaestra_sim.scene.devices.device_type import DeviceType
from palaestra_sim.scene.devices.display import DISPLAY
from palaestra_sim.scene.devices.distance_sensor import DISTANCE_SENSOR
from palaestra_sim.scene.devices.emitter import EMITTER
from palaestra_sim.scene.devices.gps import GPS
from palaestra_sim.scene.devices.gyro import GYRO
from palaestra_sim.scene.devices.inertial_unit import INERTIAL_UNIT
from palaestra_sim.scene.devices.led import LED
from palaestra_sim.scene.devices.lidar import LIDAR
from palaestra_sim.scene.devices.light_sensor import LIGHT_SENSOR
from palaestra_sim.scene.devices.motors import LINEAR_MOTOR, ROTATIONAL_MOTOR
from palaestra_sim.scene.devices.pen import PEN
from palaestra_sim.scene.devices.position_sensor import POSITION_SENSOR
from palaestra_sim.scene.devices.radar import RADAR
from palaestra_sim.scene.devices.range_finder import RANGE_FINDER
from palaestra_sim.scene.devices.receiver import RECEIVER
from palaestra_sim.scene.devices.skin import SKIN
from palaestra_sim.scene.devices.speaker import SPEAKER
from palaestra_sim.scene.devices.touch_sensor import TOUCH_SENSOR
from palaestra_sim.scene.devices.vacuum_gripper import VACUUM_GRIPPER

# By the type of the node. Robots sample in this order, so a new row goes to the end: a row in between would
# change the noise of the sensors behind it.
DEVICES: Final[Mapping[str, DeviceType[Any]]] = {
    kind.node: kind
    for kind in (
        DISTANCE_SENSOR,
        TOUCH_SENSOR,
        POSITION_SENSOR,
        ROTATIONAL_MOTOR,
        GPS,
        COMPASS,
        GYRO,
        ACCELEROMETER,
        INERTIAL_UNIT,
        ALTIMETER,
        LIGHT_SENSOR,
        LED,
        LINEAR_MOTOR,
        BRAKE,
        CAMERA,
        RANGE_FINDER,
        RADAR,
        EMITTER,
        RECEIVER,
        SPEAKER,
        PEN,
        CONNECTOR,
        VACUUM_GRIPPER,
        LIDAR,
        DISPLAY,
        SKIN,
    )
}
