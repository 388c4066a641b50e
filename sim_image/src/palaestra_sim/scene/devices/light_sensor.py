"""LightSensor: the irradiance of all lights of the world, through a color filter and a lookup table.

Shadows are not simulated, so a sensor with `occlusion` is refused in a world with lights. In a world with
lamps whose lights are not simulated, every light sensor is refused. Source: WbLightSensor.cpp of Webots.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from palaestra_sim.ros_interfaces import Row
from palaestra_sim.scene.devices.device_type import Carrier, DevicePart, DeviceTopic, DeviceType, Sample
from palaestra_sim.scene.devices.sensor_response import discrete, table_rows, table_service
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Vector
from palaestra_sim.scene.lights import Light, lights_in, unknown_light
from palaestra_sim.scene.lookup_table import LookupTable, lookup_table
from palaestra_sim.scene.nodes.scene_node import SceneNode

_TABLE: Final = ((0.0, 0.0, 0.0), (1.0, 1000.0, 0.0))  # the default of LightSensor.lookupTable


@dataclass(slots=True, kw_only=True, eq=False)
class LightSensor:
    """A light sensor; `value` is in the unit of its lookup table, or in W/m2 if `table` is None.

    Attributes:
        place: its frame; it looks along x.
        axes: the axes of the world that point east, north and up.
        filter: the shares of red, green and blue light that it measures.
        period_ms: its sampling period; 0 while it is not enabled, so that it measures darkness.
    """

    name: str
    model: str
    place: Frame
    axes: tuple[int, int, int]
    filter: Vector
    table: LookupTable | None
    resolution: float
    period_ms: int = 0
    value: float = math.nan

    def enabled(self, period_ms: int) -> None:
        """Set the sampling period."""
        self.period_ms = period_ms

    def irradiance(self, lights: Sequence[SceneNode]) -> float:
        """Return the measured irradiance in W/m2."""
        if not (self.period_ms and lights):
            return 0.0
        pose = self.place.world_pose
        return sum(Light(node, self.axes).irradiance(pose, self.filter) for node in lights)


def _read(part: DevicePart) -> LightSensor:
    *_, root = part.node.ancestors()
    if lamp := unknown_light(root):
        part.lack(f"a light sensor in a world with {lamp}, whose light is not simulated")
    if any(lights_in(root)) and part.node.flag("occlusion", False):
        part.lack("a light sensor that sees shadows (occlusion)")
    rows = table_rows(part, _TABLE)
    red, green, blue = part.reading.vector(part.node, "colorFilter", (1.0, 1.0, 1.0))
    return LightSensor(
        name=part.name,
        model=part.text("model"),
        place=part.place,
        axes=(part.axis_to("E"), part.axis_to("N"), part.axis_to("U")),
        filter=(red, green, blue),
        table=lookup_table(*rows) if rows else None,
        resolution=part.number("resolution", -1.0),
    )


def _sampler(sensors: Sequence[LightSensor], robot: Carrier) -> Sample:
    gauss = robot.gauss

    def sample() -> None:
        lights = robot.lights()
        for sensor in sensors:
            irradiance = sensor.irradiance(lights)
            value = irradiance if sensor.table is None else sensor.table.response(irradiance, gauss)
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
    enabled=LightSensor.enabled,
)
