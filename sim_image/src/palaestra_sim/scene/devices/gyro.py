"""Gyro: the angular velocity of the sensor about its own axes, in rad/s.

Webots measures the angular velocity of the nearest Solid with physics. Here the velocity includes the
velocity of every joint that carries the sensor. Source: WbGyro.cpp of Webots.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from palaestra_sim.ros_interfaces import Row
from palaestra_sim.scene.devices.device_type import Carrier, DevicePart, DeviceTopic, DeviceType, Sample
from palaestra_sim.scene.devices.imu_topic import imu_topic
from palaestra_sim.scene.devices.sensor_response import AXES_FIELDS, Axes, read_axes
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Vector, transposed, turn


@dataclass(slots=True, kw_only=True, eq=False)
class Gyro:
    """A gyro of up to three axes; `value` is in rad/s, or in the unit of its lookup table."""

    name: str
    model: str
    place: Frame
    axes: Axes
    value: Vector = (math.nan, math.nan, math.nan)


def _read(part: DevicePart) -> Gyro:
    return Gyro(name=part.name, model=part.text("model"), place=part.place, axes=read_axes(part))


def _sampler(gyros: Sequence[Gyro], robot: Carrier) -> Sample:
    gauss = robot.gauss

    def sample() -> None:
        for gyro in gyros:
            inward = transposed(gyro.place.world_pose.rotation)
            gyro.value = gyro.axes.respond(turn(inward, robot.motion(gyro.place).turning), gauss)

    return sample


def _services(gyro: Gyro) -> tuple[Row, ...]:
    return gyro.axes.services()


def _topics(gyro: Gyro) -> tuple[DeviceTopic, ...]:
    return (imu_topic("values", gyro, "angular_velocity"),)


GYRO: Final = DeviceType(
    node="Gyro",
    name="gyro",
    fields=AXES_FIELDS,
    read=_read,
    sampler=_sampler,
    services=_services,
    topics=_topics,
)
