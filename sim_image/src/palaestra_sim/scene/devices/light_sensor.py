"""LightSensor: its reading is that of its lookup table for darkness.

Light is not simulated. So in a world with lights the sensor is refused, because in Webots it would measure
it.
Source: WbLightSensor.cpp of Webots.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from palaestra_sim.ros_interfaces import Row
from palaestra_sim.scene.devices.device_type import Carrier, DevicePart, DeviceTopic, DeviceType, Sample
from palaestra_sim.scene.devices.sensor_response import discrete, table_rows, table_service
from palaestra_sim.scene.lookup_table import LookupTable, lookup_table

_LIGHTS: Final = frozenset(("DirectionalLight", "PointLight", "SpotLight", "TexturedBackgroundLight"))
_DARKNESS: Final = 0.0  # irradiance in W/m2
_TABLE: Final = ((0.0, 0.0, 0.0), (1.0, 1000.0, 0.0))  # the default of LightSensor.lookupTable


@dataclass(slots=True, kw_only=True, eq=False)
class LightSensor:
    """A light sensor; `value` is in the unit of its lookup table, which is None if the world has no rows."""

    name: str
    model: str
    table: LookupTable | None
    resolution: float
    value: float = math.nan


def _read(part: DevicePart) -> LightSensor:
    *_, root = part.node.ancestors()
    if any(node.type_name in _LIGHTS for node in root.descendants()):
        part.lack("a light sensor in a world with lights")
    rows = table_rows(part, _TABLE)
    return LightSensor(
        name=part.name,
        model=part.text("model"),
        table=lookup_table(*rows) if rows else None,
        resolution=part.number("resolution", -1.0),
    )


def _sampler(sensors: Sequence[LightSensor], robot: Carrier) -> Sample:
    gauss = robot.gauss

    def sample() -> None:
        for sensor in sensors:
            value = _DARKNESS if sensor.table is None else sensor.table.response(_DARKNESS, gauss)
            sensor.value = discrete(value, sensor.resolution)

    return sample


def _services(sensor: LightSensor) -> tuple[Row, ...]:
    return table_service(() if sensor.table is None else sensor.table.rows)


def _topics(sensor: LightSensor) -> tuple[DeviceTopic, ...]:
    type_name = "sensor_msgs/Illuminance"
    return (DeviceTopic(name="value", type_name=type_name, source=sensor, reading="illuminance"),)


LIGHT_SENSOR: Final = DeviceType(
    node="LightSensor",
    name="light sensor",
    fields="""lookupTable MFVec3f 0 0 0 1 1000 0; colorFilter SFColor 1 1 1; occlusion SFBool FALSE;
        resolution SFFloat -1""",
    read=_read,
    sampler=_sampler,
    services=_services,
    topics=_topics,
)
