"""PositionSensor: the angle of a joint's shaft."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from palaestra_sim.stub.physics.motors import Motor
from palaestra_sim.stub.scene.devices.kind import Carrier, Kind, Part, Sample, Topic
from palaestra_sim.stub.scene.devices.response import discrete


@dataclass(slots=True, kw_only=True, eq=False)
class PositionSensor:
    """The angle in radians of a motor's shaft; a joint without a motor stays at 0."""

    name: str
    motor: Motor | None
    resolution: float
    noise: float
    model: str = ""
    value: float = math.nan


def _read(part: Part) -> PositionSensor:
    if part.motor is not None and not part.motor.position_sensor:
        part.motor.position_sensor = part.name
    return PositionSensor(
        name=part.name,
        motor=part.motor,
        resolution=part.number("resolution", -1.0),
        noise=part.number("noise", 0.0),
    )


def _sampler(sensors: Sequence[PositionSensor], robot: Carrier) -> Sample:
    gauss = robot.gauss

    def sample() -> None:
        for sensor in sensors:
            angle_rad = sensor.motor.angle_rad if sensor.motor is not None else 0.0
            if sensor.noise:
                angle_rad += sensor.noise * gauss(0.0, 1.0)
            sensor.value = discrete(angle_rad, sensor.resolution)

    return sample


def _topics(sensor: PositionSensor) -> tuple[Topic, ...]:
    return (Topic(name="value", type_name="webots_ros/Float64Stamped", source=sensor),)


POSITION_SENSOR: Final = Kind(
    node="PositionSensor",
    name="position sensor",
    fields="noise SFFloat 0; resolution SFFloat -1",
    on_joint=True,
    read=_read,
    sampler=_sampler,
    topics=_topics,
)
