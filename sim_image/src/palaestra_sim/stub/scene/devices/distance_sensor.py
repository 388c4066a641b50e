"""DistanceSensor: one level ray, and the lookup table that its length goes through."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from itertools import pairwise
from typing import Final

from palaestra_sim.stub.physics.geometry import Pose, turn
from palaestra_sim.stub.physics.obstacles import Ray
from palaestra_sim.stub.physics.rays import LookupTable, lookup_table
from palaestra_sim.stub.physics.rays import Row as TableRow
from palaestra_sim.stub.scene.devices.kind import Carrier, Kind, Part, Sample, Topic
from palaestra_sim.stub.seam import Row

_LEVEL: Final = 1e-3


class DistanceSensorType(IntEnum):
    """The answers of `get_type`."""

    GENERIC = 0
    INFRA_RED = 1
    SONAR = 2
    LASER = 3


_TYPES: Final = {
    "generic": DistanceSensorType.GENERIC,
    "infra-red": DistanceSensorType.INFRA_RED,
    "sonar": DistanceSensorType.SONAR,
    "laser": DistanceSensorType.LASER,
}


@dataclass(slots=True, kw_only=True, eq=False)
class DistanceSensor:
    """One ray and its lookup table; `value` is in the table's unit, volts for a Robotino."""

    name: str
    model: str
    ray: Ray
    height_m: float
    table: LookupTable
    type: DistanceSensorType
    aperture_rad: float
    value: float = math.nan


def _read(part: Part) -> DistanceSensor:
    type_name = part.text("type", "generic")
    if type_name not in _TYPES:
        part.refuse(f"no distance sensor is of type {type_name!r}")
    if part.number("numberOfRays", 1.0) != 1.0:
        part.refuse("a distance sensor of several rays")
    if part.number("resolution", -1.0) != -1.0:
        part.refuse("a distance sensor with a resolution")
    pose = part.place.world_pose
    return DistanceSensor(
        name=part.name,
        model=part.text("model"),
        ray=_ray(part, pose),
        height_m=pose.position[2],
        table=lookup_table(*_rows(part)),
        type=_TYPES.get(type_name, DistanceSensorType.GENERIC),
        aperture_rad=part.number("aperture", 1.5708),
    )


def _ray(part: Part, pose: Pose) -> Ray:
    dx, dy, dz = turn(pose.rotation, (1.0, 0.0, 0.0))
    if abs(dz) > _LEVEL:
        part.refuse("a distance sensor that looks up or down")
    length = math.hypot(dx, dy) or 1.0
    return pose.position[0], pose.position[1], dx / length, dy / length


def _rows(part: Part) -> list[TableRow]:
    """Return the lookup table, by growing distance."""
    if "lookupTable" not in part.node.fields:
        return [(0.0, 0.0, 0.0), (0.1, 1000.0, 0.0)]
    numbers = part.node.numbers("lookupTable")
    if numbers is None or len(numbers) % 3:
        part.refuse("lookupTable is not rows of three numbers", "write distance, value, noise")
        return []
    rows = list(zip(numbers[0::3], numbers[1::3], numbers[2::3], strict=True))
    if any(after[0] <= before[0] for before, after in pairwise(rows)):
        part.refuse("the distances of lookupTable do not grow", "sort its rows")
        return []
    return rows


def _sampler(sensors: Sequence[DistanceSensor], robot: Carrier) -> Sample:
    """Cast all rays of the robot together; each sensor with noise draws it at every sample."""
    cast = robot.look(
        [it.ray for it in sensors], [it.table.reach_m for it in sensors], [it.height_m for it in sensors]
    )
    gauss = robot.gauss

    def sample() -> None:
        for sensor, distance_m in zip(sensors, cast(), strict=True):
            sensor.value = sensor.table.response(distance_m, gauss)

    return sample


def _services(sensor: DistanceSensor) -> tuple[Row, ...]:
    low, high = sensor.table.limits
    table = [number for row in sensor.table.rows for number in row]
    return (
        ("get_min_value", "get_float", lambda _: {"value": low}),
        ("get_max_value", "get_float", lambda _: {"value": high}),
        ("get_aperture", "get_float", lambda _: {"value": sensor.aperture_rad}),
        ("get_lookup_table", "get_float_array", lambda _: {"value": table}),
        ("get_type", "get_int", lambda _: {"value": int(sensor.type)}),
    )


def _topics(sensor: DistanceSensor) -> tuple[Topic, ...]:
    low, high = sensor.table.limits
    constants = {
        "radiation_type": int(sensor.type is DistanceSensorType.INFRA_RED),
        "field_of_view": sensor.aperture_rad,
        "min_range": low,
        "max_range": high,
    }
    return (Topic(name="value", type_name="sensor_msgs/Range", source=sensor, constants=constants),)


DISTANCE_SENSOR: Final = Kind(
    node="DistanceSensor",
    name="distance sensor",
    fields="""lookupTable MFVec3f 0 0 0 0.1 1000 0; type SFString generic;
        numberOfRays SFInt32 1; aperture SFFloat 1.5708; gaussianWidth SFFloat 1;
        resolution SFFloat -1; redColorSensitivity SFFloat 1""",
    read=_read,
    sampler=_sampler,
    services=_services,
    topics=_topics,
)
