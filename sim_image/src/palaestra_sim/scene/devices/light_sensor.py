"""LightSensor: the irradiance of all lights of the world, through a color filter and a lookup table.

With `occlusion`, a boundingObject or a floor between the sensor and a light hides the direct light, but the
ambient light remains. The sensor's own robot hides nothing. In a world with lamps whose lights are not
simulated, every light sensor is refused. Source: WbLightSensor.cpp and WbSimulationCluster.cpp of Webots.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from palaestra_sim.ros_interfaces import Row
from palaestra_sim.scene.devices.device_type import Carrier, DevicePart, DeviceTopic, DeviceType, Sample
from palaestra_sim.scene.devices.sensor_response import discrete, table_rows, table_service
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Vector
from palaestra_sim.scene.lights import Light, unknown_light
from palaestra_sim.scene.lookup_table import LookupTable, lookup_table
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.outlines import Outlines, free_path, robot_around
from palaestra_sim.scene.shapes import Shape

_TABLE: Final = ((0.0, 0.0, 0.0), (1.0, 1000.0, 0.0))  # the default of LightSensor.lookupTable


@dataclass(slots=True, kw_only=True, eq=False)
class LightSensor:
    """A light sensor; `value` is in the unit of its lookup table, or in W/m2 if `table` is None.

    Attributes:
        place: the frame of the sensor; the sensor looks along the x axis of this frame.
        axes: the axes of the world that point east, north and up.
        filter: the shares of red, green and blue light that the sensor measures.
        occlusion: whether shapes hide lights.
        period_ms: the sampling period; 0 while the sensor is not enabled, and its measured irradiance is 0.
    """

    name: str
    model: str
    node: SceneNode
    place: Frame
    axes: tuple[int, int, int]
    filter: Vector
    occlusion: bool
    table: LookupTable | None
    resolution: float
    period_ms: int = 0
    value: float = math.nan
    _shades: tuple[Shape, ...] = ()
    _floors_m: Callable[[], tuple[float, ...]] = tuple

    def enabled(self, period_ms: int) -> None:
        """Set the sampling period."""
        self.period_ms = period_ms

    def show(self, outlines: Outlines) -> None:
        """Set the shapes and the floors of the world."""
        robot = robot_around(self.node)
        self._shades = tuple(shape for shape in outlines.all if shape.node not in robot)
        self._floors_m = outlines.floors_m

    def irradiance(self, lights: Sequence[SceneNode]) -> float:
        """Return the measured irradiance in W/m2."""
        if not (self.period_ms and lights):
            return 0.0
        pose = self.place.world_pose
        return sum(Light(node, self.axes).irradiance(pose, self.filter, self._lit) for node in lights)

    def _lit(self, way: Vector) -> bool:
        """Return whether nothing hides a light; `way` leads to the light, in the axes of the world."""
        if not self.occlusion:
            return True
        start = self.place.ground_pose.position
        world = self.place.world_pose
        end = self.place.ground_pose.carry(world.inverse.turned(way))
        if any(min(start[2], end[2]) < height < max(start[2], end[2]) for height in self._floors_m()):
            return False
        return math.isinf(free_path(self._shades, start, end))


def _read(part: DevicePart) -> LightSensor:
    *_, root = part.node.ancestors()
    if lamp := unknown_light(root):
        part.lack(f"a light sensor in a world with {lamp}, whose light is not simulated")
    rows = table_rows(part, _TABLE)
    red, green, blue = part.reading.vector(part.node, "colorFilter", (1.0, 1.0, 1.0))
    return LightSensor(
        name=part.name,
        model=part.text("model"),
        node=part.node,
        place=part.place,
        axes=(part.axis_to("E"), part.axis_to("N"), part.axis_to("U")),
        filter=(red, green, blue),
        occlusion=part.node.flag("occlusion", False),
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
