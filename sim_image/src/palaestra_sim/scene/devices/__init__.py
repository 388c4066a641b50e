"""The devices of robots: one table, with a row for each type of node.

A row (`DeviceType`) defines one type of device. The row has the functions that read a device from the world
and sample its value, the services, the topics with their messages, and the rule of `enable`. The fault
`wrong_value` needs no entry in the row, because it changes messages of any type. A new device is one
file in this package and one line in `DEVICES`; CONTRIBUTING.md has the steps.

- `device_type`: the definition of a row
- `distance_sensor`, `touch_sensor`: rows of sensors for obstacles
- `motors`, `brake`, `position_sensor`: rows of devices on joints
- `lidar`, `lidar_rays`: the row of a sensor with many rays, and the directions of these rays
- `gps`, `compass`, `gyro`, `accelerometer`, `inertial_unit`: rows of sensors for position and motion
- `altimeter`, `light_sensor`: rows of sensors for height and light
- `emitter`, `receiver`: rows of radio devices
- `connector`: the row of a device that detects another connector
- `led`, `speaker`, `pen`, `display`: rows of devices that only store the values that a program sets
- `camera`, `range_finder`: rows of devices with images
- `camera_common`, `recognition`: the lens of both devices, and the objects that a camera recognizes
- `radar`: the row of a sensor that measures the distances and speeds of targets
- `vacuum_gripper`: the row of a gripper, which never holds an object here
- `skin`: the row of animated meshes, which are not loaded here
- `sensor_response`: lookup tables, resolution and axes, which several sensors share
- `step_timer`: the time between two samples, for a head that turns or noise that drifts
- `imu_topic`: the topic of sensors that send a sensor_msgs/Imu
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

# The keys are the types of nodes. Robots sample in this order, so append new rows: a row in between would
# change the noise of the later sensors.
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
