"""Sensors of pose, direction and environment on a robot that does not move, with formulas for their values.

A row has the device's text in a world file, and a formula of the sensor's frame in the axes of the world
file. `MOUNT` mounts every device off the robot's center and rotated. A test moves the robot to each of
`POSES`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tests.values.frames import frame, quaternion
from tests.values.worlds import Setting

GRAVITY = 3.7  # m/s2, in these worlds; it differs from the default
REFERENCE = np.array([100.0, -20.0, 7.0])  # WorldInfo.gpsReference, in the axes of the file
MOUNT = frame((0.1, -0.25, 0.3), (0.6, 0.0, 0.8), 0.9)  # the frame of each sensor, in the robot's frame
POSES = (  # poses of the robot, in the axes of the ground
    frame((1.2, -0.7, 0.4), (0.3, -0.5, 0.8), 1.1),
    frame((-2.0, 3.0, 1.5), (1.0, 0.0, 0.0), 2.2),
    frame((0.1, 0.2, -3.0), (-0.6, 0.64, 0.48), -2.7),
    frame((5.0, 5.0, 0.5), (0.0, 0.0, 1.0), 0.7),
)
BEACON = frame((2.0, 1.0, -0.5))  # the pose of the robot that emits, in the axes of the ground
SAID = "here"


@dataclass(frozen=True)
class Row:
    """A device and the formula of its value.

    Attributes:
            name: the name of the row and of its device.
            types: the device types that the row tests.
            node: the text of the node; `{place}` stands for its name and its pose.
            formula: returns numbers, (n,), for the frame of the sensor and the setting.
            read: returns the compared value of the device.
            tolerance: absolute tolerance in the unit of the value.
    """

    name: str
    types: tuple[str, ...]
    node: str
    formula: Callable
    read: Callable = lambda device: device.value
    tolerance: float = 1e-9


def _through(table, value):
    """Return the output of a lookup table: linear between the rows, constant outside."""
    inputs, outputs = zip(*table, strict=True)
    return np.interp(value, inputs, outputs)


def _gravity(sensor, setting):
    """Return the reading of an accelerometer at rest: the reaction to gravity, in the sensor's axes."""
    return sensor.rotation.T @ (GRAVITY * setting.up)


def _beacon(sensor, setting: Setting):
    """Return the vector from a sensor to the beacon, in the sensor's axes."""
    return sensor.inverse @ setting.put(BEACON).position


def _signal(sensor, setting):
    way = _beacon(sensor, setting)
    return np.array([1.0 / (way @ way), *(way / np.linalg.norm(way))])


def _packet(receiver):
    """Return strength and direction of the receiver's last packet."""
    packet = receiver.queue[-1]
    return [packet.strength, *packet.direction]


ROWS = (
    Row("accelerometer", ("Accelerometer",), "Accelerometer {{ {place} }}", _gravity),
    Row(
        "accelerometer table",
        ("Accelerometer",),
        "Accelerometer {{ {place} lookupTable [ -3 10 0, 0 20 0, 2 100 0 ] }}",
        lambda sensor, setting: _through([(-3, 10), (0, 20), (2, 100)], _gravity(sensor, setting)),
    ),
    Row(
        "accelerometer resolution",
        ("Accelerometer",),
        "Accelerometer {{ {place} resolution 0.5 }}",
        lambda sensor, setting: 0.5 * np.round(_gravity(sensor, setting) / 0.5),
    ),
    Row(
        "accelerometer axes",
        ("Accelerometer",),
        "Accelerometer {{ {place} xAxis FALSE zAxis FALSE }}",
        lambda sensor, setting: _gravity(sensor, setting) * [np.nan, 1.0, np.nan],
    ),
    Row(
        "altimeter",
        ("Altimeter",),
        "Altimeter {{ {place} }}",
        lambda sensor, setting: [(sensor.position + REFERENCE) @ setting.up],
        read=lambda device: [device.value],
    ),
    Row(
        "compass",
        ("Compass",),
        "Compass {{ {place} }}",
        lambda sensor, setting: sensor.rotation.T @ setting.north,
    ),
    Row(
        "compass axes",
        ("Compass",),
        "Compass {{ {place} yAxis FALSE }}",
        lambda sensor, setting: (sensor.rotation.T @ setting.north) * [1.0, np.nan, 1.0],
    ),
    Row(
        "compass other axes",
        ("Compass",),
        "Compass {{ {place} xAxis FALSE zAxis FALSE }}",
        lambda sensor, setting: (sensor.rotation.T @ setting.north) * [np.nan, 1.0, np.nan],
    ),
    Row("gps", ("GPS",), "GPS {{ {place} }}", lambda sensor, _: sensor.position + REFERENCE),
    Row(
        "gps at rest",
        ("GPS",),
        "GPS {{ {place} }}",
        lambda *_: np.zeros(4),
        read=lambda device: [device.speed.value, *device.speed_vector.value],
    ),
    Row("gyro", ("Gyro",), "Gyro {{ {place} }}", lambda *_: np.zeros(3)),
    Row("gyro axes", ("Gyro",), "Gyro {{ {place} xAxis FALSE }}", lambda *_: np.array([np.nan, 0.0, 0.0])),
    Row(
        "inertial unit",
        ("InertialUnit",),
        "InertialUnit {{ {place} }}",
        lambda sensor, _: quaternion(sensor.rotation),
    ),
    Row(
        "light sensor",
        ("LightSensor",),
        "LightSensor {{ {place} lookupTable [ 0 3 0, 1 1000 0 ] }}",
        lambda *_: [3.0],  # the world contains no light
        read=lambda device: [device.value],
    ),
    Row("receiver", ("Receiver", "Emitter"), "Receiver {{ {place} channel 3 }}", _signal, read=_packet),
    Row(
        "position sensor",
        ("PositionSensor",),
        """HingeJoint {{ jointParameters HingeJointParameters {{ position 0.3 axis 0 1 0 }}
          device PositionSensor {{ name "position sensor" resolution 0.25 }} endPoint Solid {{ }} }}""",
        lambda *_: [0.25],
        read=lambda device: [device.value],
    ),
)
