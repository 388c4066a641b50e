"""Accelerometer: the acceleration of the sensor over the last basic step, plus the reaction to gravity.

At rest it reports WorldInfo.gravity upward. Webots computes the acceleration over the sensor's sampling
period, which gives the same value for a period of one basic step. Source: WbAccelerometer.cpp of Webots.
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
class Accelerometer:
    """An accelerometer of up to three axes; `value` is in m/s2, or in the unit of its lookup table."""

    name: str
    model: str
    place: Frame
    gravity: float
    axes: Axes
    value: Vector = (math.nan, math.nan, math.nan)


def _read(part: DevicePart) -> Accelerometer:
    return Accelerometer(
        name=part.name,
        model=part.text("model"),
        place=part.place,
        gravity=part.reading.gravity(),
        axes=read_axes(part),
    )


def _sampler(sensors: Sequence[Accelerometer], robot: Carrier) -> Sample:
    gauss = robot.gauss
    followed = [(sensor, robot.follow(sensor.place)) for sensor in sensors]

    def sample() -> None:
        for sensor, acceleration in followed:
            x, y, z = sensor.place.to_ground(acceleration())
            inward = transposed(sensor.place.ground_pose.rotation)
            sensor.value = sensor.axes.respond(turn(inward, (x, y, z + sensor.gravity)), gauss)

    return sample


def _services(sensor: Accelerometer) -> tuple[Row, ...]:
    return sensor.axes.services()


def _topics(sensor: Accelerometer) -> tuple[DeviceTopic, ...]:
    return (imu_topic("values", sensor, "linear_acceleration"),)


ACCELEROMETER: Final = DeviceType(
    node="Accelerometer",
    name="accelerometer",
    fields=AXES_FIELDS,
    read=_read,
    sampler=_sampler,
    services=_services,
    topics=_topics,
)
