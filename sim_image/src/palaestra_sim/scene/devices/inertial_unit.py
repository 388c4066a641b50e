"""InertialUnit: the rotation of the sensor in the world. Source: WbInertialUnit.cpp of Webots."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from palaestra_sim.ros_interfaces import Row
from palaestra_sim.scene.devices.device_type import Carrier, DevicePart, DeviceTopic, DeviceType, Sample
from palaestra_sim.scene.devices.imu_topic import imu_topic
from palaestra_sim.scene.devices.sensor_response import Gauss, discrete
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import (
    Matrix,
    Quaternion,
    from_axis_angle,
    multiply,
    to_quaternion,
)


@dataclass(slots=True, kw_only=True, eq=False)
class InertialUnit:
    """An inertial unit; `value` is x, y, z, w of the quaternion of its rotation.

    Attributes:
        noise: standard deviation of the noise about each axis, as a fraction of pi.
        resolution: the resolution of each number of the quaternion; -1 for exact values.
    """

    name: str
    model: str
    place: Frame
    noise: float
    resolution: float
    value: Quaternion = (math.nan, math.nan, math.nan, math.nan)


def _read(part: DevicePart) -> InertialUnit:
    if not all(part.node.flag(axis, default=True) for axis in ("xAxis", "yAxis", "zAxis")):
        part.lack("an inertial unit with an axis that is switched off")
    return InertialUnit(
        name=part.name,
        model=part.text("model"),
        place=part.place,
        noise=part.number("noise", 0.0),
        resolution=part.number("resolution", -1.0),
    )


def _sampler(units: Sequence[InertialUnit], robot: Carrier) -> Sample:
    gauss = robot.gauss

    def sample() -> None:
        for unit in units:
            rotation = unit.place.world_pose.rotation
            if unit.noise:
                rotation = multiply(rotation, _shaken(unit.noise * math.pi, gauss))
            x, y, z, w = (discrete(number, unit.resolution) for number in to_quaternion(rotation))
            unit.value = x, y, z, w

    return sample


def _shaken(deviation_rad: float, gauss: Gauss) -> Matrix:
    """Return a random rotation: about x, then y, then z."""
    roll, pitch, yaw = (from_axis_angle((*axis, deviation_rad * gauss(0.0, 1.0))) for axis in _AXES)
    return multiply(yaw, multiply(pitch, roll))


_AXES: Final = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def _services(unit: InertialUnit) -> tuple[Row, ...]:
    return (("get_noise", "get_float", lambda _: {"value": unit.noise}),)


def _topics(unit: InertialUnit) -> tuple[DeviceTopic, ...]:
    return (imu_topic("quaternion", unit, "orientation"),)


INERTIAL_UNIT: Final = DeviceType(
    node="InertialUnit",
    name="inertial unit",
    fields="""noise SFFloat 0; xAxis SFBool TRUE; yAxis SFBool TRUE; zAxis SFBool TRUE;
        resolution SFFloat -1""",
    read=_read,
    sampler=_sampler,
    services=_services,
    topics=_topics,
)
