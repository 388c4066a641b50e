"""DistanceSensor: its rays, and the lookup table that converts their lengths to a value.

Several rays form a cone around the x axis. A sonar measures the distance of the nearest hit. The other types
measure the average distance, in which rays near the axis have larger weights. Infra-red rays meet visible
shapes, and a darker shape appears farther away. The rays of other types meet boundingObjects. Source:
reference/distancesensor.md and WbDistanceSensor.cpp of Webots.

A sonar detects a surface only if its ray meets the surface within 22.5 degrees of the normal. Four additional
rays next to each ray measure this angle, so a physics does not have to provide normals.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum
from itertools import islice
from typing import Final, TypeVar

from palaestra_sim.ros_interfaces import Row
from palaestra_sim.scene.devices.device_type import Carrier, DevicePart, DeviceTopic, DeviceType, Sample
from palaestra_sim.scene.devices.sensor_response import discrete, table_rows, table_service
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Pose, Vector
from palaestra_sim.scene.lookup_table import LookupTable, lookup_table
from palaestra_sim.scene.lookup_table import Row as TableRow
from palaestra_sim.scene.sensor_rays import Beam, beam_along
from palaestra_sim.scene.visual_rays import Glance

T = TypeVar("T")

_LEAST_RAD: Final = 1e-9  # replaces a width of 0, which is refused
_MOST_RAYS: Final = 10_000  # maximum number of rays of a sensor, because each ray is cast at every step
_BESIDE_M: Final = 1e-4  # distance of the additional rays from the ray of a sonar
_BEAMS_OF_SONAR: Final = 5  # number of beams for each ray of a sonar
_STEEPEST: Final = math.tan(math.pi / 8.0)  # slope of the steepest surface that returns a sonar's ray
_TABLE: Final = ((0.0, 0.0, 0.0), (0.1, 1000.0, 0.0))  # the default of DistanceSensor.lookupTable
_EMPTY: Final = ((0.0, 0.0, 0.0),)  # replaces a table without rows; the sensor then measures 0
# For each number of rays from 1 to 10, the rings of the cone. Each ring has a number of rays, a rotation as a
# share of the spacing between its rays, and an opening angle as a share of the aperture.
_RINGS: Final = (
    ((1, 0.0, 0.0),),
    ((2, 0.5, 1.0),),
    ((3, 0.0, 1.0),),
    ((1, 0.0, 0.0), (3, 0.0, 1.0)),
    ((1, 0.0, 0.0), (4, 0.0, 1.0)),
    ((1, 0.0, 0.0), (5, 0.0, 1.0)),
    ((1, 0.0, 0.0), (6, 0.0, 1.0)),
    ((1, 0.0, 0.0), (7, 0.0, 1.0)),
    ((3, 0.0, 0.3), (6, 0.0, 1.0)),
    ((1, 0.0, 0.0), (3, 0.0, 0.5), (6, 0.0, 1.0)),
)


class DistanceSensorType(IntEnum):
    """The numbers that `get_type` returns."""

    GENERIC = 0
    INFRA_RED = 1
    SONAR = 2
    LASER = 3


# The names are in lower case, because the case of letters in a world does not matter.
_TYPES: Final = {
    "generic": DistanceSensorType.GENERIC,
    "infra-red": DistanceSensorType.INFRA_RED,
    "infrared": DistanceSensorType.INFRA_RED,
    "sonar": DistanceSensorType.SONAR,
    "laser": DistanceSensorType.LASER,
}


@dataclass(slots=True, kw_only=True, eq=False)
class DistanceSensor:
    """Rays with their weights, and a lookup table; `value` is in the table's unit, such as volts.

    A sonar has five beams for each ray: the ray itself, and two pairs of beams next to it.

    Attributes:
        beams: the rays, in the frame of the mount.
        mount: the frame of the joint that moves the sensor; None if no joint moves it.
        rows: the rows of the lookup table, as in the world.
        sensitivity: the effect of the color on an infra-red sensor; 0 for no effect.
        resolution: the resolution of the value; -1 for exact values.
    """

    name: str
    model: str
    beams: tuple[Beam, ...]
    weights: tuple[float, ...]
    table: LookupTable
    type: DistanceSensorType
    aperture_rad: float
    mount: Frame | None = None
    rows: tuple[TableRow, ...] = ()
    sensitivity: float = 1.0
    resolution: float = -1.0
    value: float = math.nan


def _read(part: DevicePart) -> DistanceSensor:
    type_name = part.text("type", "generic").lower()
    if type_name not in _TYPES:
        part.refuse(f"{type_name!r} is not a type of distance sensor", f"use {', '.join(_TYPES)}")
    rows = tuple(table_rows(part, _TABLE, "distances"))
    table = lookup_table(*(rows or _EMPTY))
    aperture_rad = part.number("aperture", 1.5708)
    # As in Webots, a laser always has one ray. Webots prints a warning if the world sets another number.
    rays = 1 if type_name == "laser" else int(part.number("numberOfRays", 1.0))
    if rays > _MOST_RAYS:
        part.refuse(f"a distance sensor with {rays} rays", f"use 1 to {_MOST_RAYS}")
        rays = 1
    cone = _cone(rays, aperture_rad)
    return DistanceSensor(
        name=part.name,
        model=part.text("model"),
        mount=part.mount,
        beams=tuple(_beams(part.mounted(part.place), cone, table.reach_m, sonar=type_name == "sonar")),
        weights=_weights(part, cone, aperture_rad),
        table=table,
        rows=rows,
        type=_TYPES.get(type_name, DistanceSensorType.GENERIC),
        aperture_rad=aperture_rad,
        sensitivity=part.number("redColorSensitivity", 1.0),
        resolution=part.number("resolution", -1.0),
    )


def _beams(pose: Pose, cone: Sequence[Vector], reach_m: float, *, sonar: bool) -> Iterator[Beam]:
    """Yield the beams of a sensor's rays; `pose` is the pose of the sensor in its mount."""
    for direction in cone:
        yield beam_along(pose, direction, reach_m)
        if sonar:
            x, y, z = direction
            level = math.hypot(x, y)
            across = (-y / level, x / level, 0.0) if level else (0.0, 1.0, 0.0)
            up = (-across[1] * z, across[0] * z, level) if level else (1.0, 0.0, 0.0)
            for side in (across, up):
                for sign in (-_BESIDE_M, _BESIDE_M):
                    origin = pose.carry((side[0] * sign, side[1] * sign, side[2] * sign))
                    yield beam_along(Pose(origin, pose.rotation), direction, reach_m)


def _cone(count: int, aperture_rad: float) -> list[Vector]:
    """Return the directions of the rays, unit vectors in the frame of the sensor."""
    if count <= 1 or aperture_rad == 0.0:
        return [(1.0, 0.0, 0.0)]
    if count <= len(_RINGS):
        polar = [
            (2.0 * math.pi * (index + offset) / size, share)
            for size, offset, share in _RINGS[count - 1]
            for index in range(size)
        ]
    else:
        polar = _many(count)
    return [_direction(alpha, share * aperture_rad / 2.0) for alpha, share in polar]


def _many(count: int) -> list[tuple[float, float]]:
    """Return each ray's angle around the axis and share of the aperture; rings have 1, 4, 7, ... rays."""
    rings: list[int] = []
    left = count
    while left > 0:
        rings.append(min(left, 3 * len(rings) + 1))
        left -= rings[-1]
    polar: list[tuple[float, float]] = []
    for ring, size in enumerate(rings):
        first = len(polar)  # Webots does not restart the count at each ring
        share = ring / (len(rings) - 1)
        polar += [(2.0 * math.pi * (first + index) / size, share) for index in range(size)]
    return polar


def _direction(alpha: float, theta: float) -> Vector:
    """Return the direction at the angle `theta` to the axis, rotated about the axis by `alpha` from up."""
    alpha += math.pi / 2.0
    return math.cos(theta), math.sin(theta) * math.sin(alpha), -math.sin(theta) * math.cos(alpha)


def _weights(part: DevicePart, cone: Sequence[Vector], aperture_rad: float) -> tuple[float, ...]:
    """Return the share of each ray in the average: a normal distribution over its angle to the axis."""
    given = part.number("gaussianWidth", 1.0)
    if len(cone) == 1:
        return (1.0,)
    width_rad = abs(given * aperture_rad) or _LEAST_RAD
    weights = [math.exp(-((math.acos(min(1.0, x)) / width_rad) ** 2)) for x, _, _ in cone]
    total = sum(weights)
    if not total or not given:
        part.refuse(
            f"with the gaussianWidth {given:g}, no ray has a weight", "write a larger number, such as 1"
        )
        return (1.0 / len(cone),) * len(cone)
    return tuple(weight / total for weight in weights)


def _sampler(sensors: Sequence[DistanceSensor], robot: Carrier) -> Sample:
    """Return a function that casts all rays of the robot together; noise is drawn at every sample."""
    sample = _fine(sensors, robot)
    coarse = [sensor for sensor in sensors if sensor.resolution > 0.0]
    if not coarse:
        return sample

    def sample_coarse() -> None:
        sample()
        for sensor in coarse:
            sensor.value = discrete(sensor.value, sensor.resolution)

    return sample_coarse


def _fine(sensors: Sequence[DistanceSensor], robot: Carrier) -> Sample:
    """Return the sample function of sensors, before their resolutions are applied."""
    if any(sensor.type is DistanceSensorType.INFRA_RED for sensor in sensors):
        return _with_infrared(sensors, robot)
    cast = _together(robot.look, sensors)
    gauss = robot.gauss

    if all(len(sensor.beams) == 1 for sensor in sensors):

        def sample_single() -> None:
            for sensor, distance_m in zip(sensors, cast(), strict=True):
                sensor.value = sensor.table.response(distance_m, gauss)

        return sample_single

    def sample() -> None:
        distances = iter(cast())
        for sensor in sensors:
            own = list(islice(distances, len(sensor.beams)))
            sensor.value = sensor.table.response(_measured(sensor, own), gauss)

    return sample


def _with_infrared(sensors: Sequence[DistanceSensor], robot: Carrier) -> Sample:
    """Return the sample function for sensors of which some are infra-red."""
    infrared = [it for it in sensors if it.type is DistanceSensorType.INFRA_RED]
    others = [it for it in sensors if it.type is not DistanceSensorType.INFRA_RED]
    cast: Callable[[], Sequence[float]] = tuple
    if others:
        cast = _together(robot.look, others)
    reflect = _together(robot.reflect, infrared)
    gauss = robot.gauss

    def sample() -> None:
        distances, glances = iter(cast()), iter(reflect())
        for sensor in sensors:
            rays = len(sensor.beams)
            if sensor.type is DistanceSensorType.INFRA_RED:
                measured_m = _reflected(sensor, list(islice(glances, rays)))
            else:
                measured_m = _measured(sensor, list(islice(distances, rays)))
            sensor.value = sensor.table.response(measured_m, gauss)

    return sample


def _together(
    cast: Callable[[Sequence[Beam], Frame | None], Callable[[], Sequence[T]]],
    sensors: Sequence[DistanceSensor],
) -> Callable[[], Sequence[T]]:
    """Return a function that casts the beams of all sensors; the sensors on a mount are cast together."""
    mounts = dict.fromkeys(sensor.mount for sensor in sensors)
    casts = {
        mount: cast([beam for it in sensors if it.mount is mount for beam in it.beams], mount)
        for mount in mounts
    }
    if len(casts) == 1:
        return next(iter(casts.values()))

    def cast_all() -> Sequence[T]:
        found = {mount: iter(cast_of()) for mount, cast_of in casts.items()}
        return [it for sensor in sensors for it in islice(found[sensor.mount], len(sensor.beams))]

    return cast_all


def _measured(sensor: DistanceSensor, distances_m: Sequence[float]) -> float:
    if sensor.type is DistanceSensorType.SONAR:
        return min(_returned(distances_m), default=sensor.table.reach_m)
    return sum(distance * weight for distance, weight in zip(distances_m, sensor.weights, strict=True))


def _returned(distances_m: Sequence[float]) -> Iterator[float]:
    """Yield the distances of a sonar's rays that meet a surface within 22.5 degrees of the normal.

    At an edge, the two beams of a pair may have different lengths. Of these two beams, the beam whose length
    is closer to the length of the ray decides.
    """
    for first in range(0, len(distances_m), _BEAMS_OF_SONAR):
        distance, left, right, below, above = distances_m[first : first + _BEAMS_OF_SONAR]
        across = min(abs(left - distance), abs(right - distance)) / _BESIDE_M
        along = min(abs(below - distance), abs(above - distance)) / _BESIDE_M
        if math.hypot(across, along) < _STEEPEST:
            yield distance


def _reflected(sensor: DistanceSensor, glances: Sequence[Glance]) -> float:
    """Return the average distance, increased if the surface does not return all light."""
    light = sum(it.reflection * weight for it, weight in zip(glances, sensor.weights, strict=True))
    distance_m = _measured(sensor, [it.distance_m for it in glances])
    return distance_m + (distance_m / light - distance_m) * sensor.sensitivity


def _services(sensor: DistanceSensor) -> tuple[Row, ...]:
    low, high = sensor.table.limits
    return (
        ("get_min_value", "get_float", lambda _: {"value": low}),
        ("get_max_value", "get_float", lambda _: {"value": high}),
        ("get_aperture", "get_float", lambda _: {"value": sensor.aperture_rad}),
        *table_service(sensor.rows),
        ("get_type", "get_int", lambda _: {"value": int(sensor.type)}),
    )


def _topics(sensor: DistanceSensor) -> tuple[DeviceTopic, ...]:
    low, high = sensor.table.limits
    constants = {
        "radiation_type": int(sensor.type is DistanceSensorType.INFRA_RED),
        "field_of_view": sensor.aperture_rad,
        "min_range": low,
        "max_range": high,
    }
    return (DeviceTopic(name="value", type_name="sensor_msgs/Range", source=sensor, constants=constants),)


DISTANCE_SENSOR: Final = DeviceType(
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
