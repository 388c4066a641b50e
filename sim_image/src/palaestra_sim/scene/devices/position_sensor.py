"""PositionSensor: the angle of a hinge, or the length of a slider."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from palaestra_sim.ros_interfaces import Row
from palaestra_sim.scene.devices.device_type import (
    Carrier,
    DevicePart,
    DeviceTopic,
    DeviceType,
    Sample,
    Shaft,
)
from palaestra_sim.scene.devices.sensor_response import discrete


@dataclass(slots=True, kw_only=True, eq=False)
class PositionSensor:
    """The position of a hinge in rad, or of a slider in m."""

    name: str
    shaft: Shaft
    resolution: float
    noise: float
    model: str = ""
    value: float = math.nan


def _read(part: DevicePart) -> PositionSensor:
    return PositionSensor(
        name=part.name,
        shaft=part.shaft or Shaft(),
        resolution=part.number("resolution", -1.0),
        noise=part.number("noise", 0.0),
    )


def _sampler(sensors: Sequence[PositionSensor], robot: Carrier) -> Sample:
    gauss = robot.gauss

    def sample() -> None:
        for sensor in sensors:
            position = sensor.shaft.position
            if sensor.noise:
                position += sensor.noise * gauss(0.0, 1.0)
            sensor.value = discrete(position, sensor.resolution)

    return sample


def _services(sensor: PositionSensor) -> tuple[Row, ...]:
    return (("get_type", "get_int", lambda _: {"value": sensor.shaft.type_number}),)


def _topics(sensor: PositionSensor) -> tuple[DeviceTopic, ...]:
    return (DeviceTopic(name="value", type_name="webots_ros/Float64Stamped", source=sensor),)


POSITION_SENSOR: Final = DeviceType(
    node="PositionSensor",
    name="position sensor",
    fields="noise SFFloat 0; resolution SFFloat -1",
    role="position_sensor",
    read=_read,
    sampler=_sampler,
    services=_services,
    topics=_topics,
)
