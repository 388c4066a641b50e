"""Sensors of a robot: what they are, and the value each has after a step."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Final

from palaestra_sim.stub.motors import Motor
from palaestra_sim.stub.obstacles import Ray
from palaestra_sim.stub.physics import Body
from palaestra_sim.stub.rays import LookupTable


class DistanceSensorType(IntEnum):
    """What `get_type` of a distance sensor answers."""

    GENERIC = 0
    INFRA_RED = 1
    SONAR = 2
    LASER = 3


class TouchSensorType(IntEnum):
    """What `get_type` of a touch sensor answers."""

    BUMPER = 0
    FORCE = 1
    FORCE_3D = 2


DISTANCE_SENSOR_TYPES: Final = {
    "generic": DistanceSensorType.GENERIC,
    "infra-red": DistanceSensorType.INFRA_RED,
    "sonar": DistanceSensorType.SONAR,
    "laser": DistanceSensorType.LASER,
}


@dataclass(slots=True, kw_only=True, eq=False)
class DistanceSensor:
    """One ray and its lookup table; `value` is in the table's unit, volts for a Robotino."""

    name: str
    ray: Ray
    table: LookupTable
    type: DistanceSensorType = DistanceSensorType.GENERIC
    aperture_rad: float = 1.5708
    model: str = ""
    value: float = math.nan


@dataclass(slots=True, kw_only=True, eq=False)
class TouchSensor:
    """A bumper; `value` is whether its robot touched anything since the sensor was last sampled."""

    name: str
    body: Body | None
    type: TouchSensorType = TouchSensorType.BUMPER
    model: str = ""
    value: bool = False


@dataclass(slots=True, kw_only=True, eq=False)
class PositionSensor:
    """The angle in radians of a motor's shaft; a joint without a motor stays at 0."""

    name: str
    motor: Motor | None
    resolution: float = -1.0
    noise: float = 0.0
    model: str = ""
    value: float = math.nan


Sensor = DistanceSensor | TouchSensor | PositionSensor


@dataclass(slots=True, kw_only=True, eq=False)
class Devices:
    """All devices of a robot by name, in the order of the world file."""

    motors: dict[str, Motor] = field(default_factory=dict)
    sensors: dict[str, Sensor] = field(default_factory=dict)
    order: list[str] = field(default_factory=list)

    def of_distance(self) -> tuple[DistanceSensor, ...]:
        """Return the distance sensors, in the order of the world file."""
        return tuple(it for it in self.sensors.values() if isinstance(it, DistanceSensor))


def sample(sensor: TouchSensor | PositionSensor, gauss: Callable[[float, float], float]) -> None:
    """Give a sensor that isn't a ray the value of this moment."""
    if isinstance(sensor, TouchSensor):
        if sensor.body is not None:
            sensor.value = sensor.body.touched
            sensor.body.touched = False
        return
    angle = sensor.motor.angle_rad if sensor.motor is not None else 0.0
    if sensor.noise:
        angle += sensor.noise * gauss(0.0, 1.0)
    if sensor.resolution > 0.0:
        angle = sensor.resolution * round(angle / sensor.resolution)
    sensor.value = angle
