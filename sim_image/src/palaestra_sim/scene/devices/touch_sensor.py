"""TouchSensor: a bumper, or a sensor of the force that the sensor exerts on the robot.

A sensor of type `force` measures the pressure along its x axis. A sensor of type `force-3d` measures the
force along each of its axes. Both types need a Physics node, and a physics with forces. Source:
WbTouchSensor.cpp of Webots.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from palaestra_sim.ros_interfaces import Row
from palaestra_sim.scene.devices.device_type import Carrier, DevicePart, DeviceTopic, DeviceType, Sample
from palaestra_sim.scene.devices.sensor_response import Gauss, discrete, table_rows, table_service
from palaestra_sim.scene.links import Link
from palaestra_sim.scene.lookup_table import LookupTable, lookup_table
from palaestra_sim.scene.old_axes import of_old_axes
from palaestra_sim.scene.shapes import Shape

_TYPES: Final = ("bumper", "force", "force-3d")  # the index is the number that `get_type` returns
_BUMPER, _FORCE, _FORCE_3D = range(3)
_TABLE: Final = ((0.0, 0.0, 0.0), (5000.0, 50000.0, 0.0))  # the default of TouchSensor.lookupTable
_NOTHING: Final = (0.0, 0.0, 0.0)


@dataclass(slots=True, kw_only=True, eq=False)
class TouchSensor:
    """A touch sensor.

    Attributes:
        outline: the shapes of the sensor.
        type: the number of one of `_TYPES`.
        link: the link whose force is measured; None for a bumper.
        table: the lookup table of a force; None if the value is the force itself.
        resolution: the resolution of a force; -1 for exact values.
        value: for a bumper, whether the bumper was touched since the last sample; for other types, the force
            as one number or three.
    """

    name: str
    model: str
    outline: Sequence[Shape]
    type: int = _BUMPER
    link: Link | None = None
    table: LookupTable | None = field(default_factory=lambda: lookup_table(*_TABLE))
    resolution: float = -1.0
    value: Any = False
    of_old_axes: bool = False

    def feel(self, gauss: Gauss) -> None:
        """Set the value to the current force."""
        x, y, z = _NOTHING if self.link is None else self.link.force
        if self.of_old_axes:
            x, y, z = z, x, y
        if self.type == _FORCE:
            self.value = self._response(max(0.0, -x), gauss)  # a pull does not count as pressure
        else:
            self.value = tuple(self._response(part, gauss) for part in (x, y, z))

    def _response(self, force: float, gauss: Gauss) -> float:
        if self.table is not None:
            force = self.table.response(force, gauss)
        return discrete(force, self.resolution)


@dataclass(frozen=True, slots=True)
class Wrench:
    """The force of a sensor, as a geometry_msgs/Wrench without torque."""

    sensor: TouchSensor

    @property
    def value(self) -> dict[str, Any]:
        """The force of the last sample."""
        return {"force": self.sensor.value, "torque": _NOTHING}


def _read(part: DevicePart) -> TouchSensor:
    type_name = part.text("type", "bumper")
    kind = _TYPES.index(type_name) if type_name in _TYPES else _BUMPER
    if type_name != "bumper" and not part.forces:
        part.lack("a touch sensor that measures force")
    sensor = TouchSensor(
        name=part.name,
        model=part.text("model"),
        outline=part.shapes,
        type=kind,
        of_old_axes=of_old_axes(part.node),
    )
    if kind and part.forces:
        rows = table_rows(part, _TABLE, "forces")
        sensor.table = lookup_table(*rows) if rows else None
        sensor.resolution = part.number("resolution", -1.0)
        sensor.link = part.measure()
        sensor.value = 0.0 if kind == _FORCE else _NOTHING
    return sensor


def _sampler(sensors: Sequence[TouchSensor], robot: Carrier) -> Sample:
    """Return the sample function; only bumpers in the outline of the body can be touched.

    The function reads all bumpers before it clears the contacts, so that each bumper gets its own contacts.
    """
    body, gauss = robot.body, robot.gauss
    forces = [sensor for sensor in sensors if sensor.link is not None]
    bumpers = [sensor for sensor in sensors if sensor.link is None]
    outer = (
        [] if body is None else [(sensor, bits) for sensor in bumpers if (bits := body.bits(sensor.outline))]
    )

    def sample() -> None:
        if body is not None:
            for sensor, bits in outer:
                sensor.value = bool(body.touched & bits)
            body.touched = 0
        for sensor in forces:
            sensor.feel(gauss)

    return sample


def _services(sensor: TouchSensor) -> tuple[Row, ...]:
    rows = () if sensor.table is None else sensor.table.rows
    return (
        ("get_type", "get_int", lambda _: {"value": sensor.type}),
        *table_service(rows),
    )


def _topics(sensor: TouchSensor) -> tuple[DeviceTopic, ...]:
    if sensor.type == _BUMPER:
        return (DeviceTopic(name="value", type_name="webots_ros/BoolStamped", source=sensor),)
    if sensor.type == _FORCE:
        return (DeviceTopic(name="value", type_name="webots_ros/Float64Stamped", source=sensor),)
    return (
        DeviceTopic(
            name="values", type_name="geometry_msgs/WrenchStamped", source=Wrench(sensor), reading="wrench"
        ),
    )


TOUCH_SENSOR: Final = DeviceType(
    node="TouchSensor",
    name="touch sensor",
    fields="type SFString bumper; lookupTable MFVec3f 0 0 0 5000 50000 0; resolution SFFloat -1",
    read=_read,
    sampler=_sampler,
    services=_services,
    topics=_topics,
)
