"""GPS: its position in meters, and its speed.

Its coordinates are those of the world plus WorldInfo.gpsReference (the system "local"). Latitude and
longitude (WGS84) are refused. Source: WbGps.cpp of Webots.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from palaestra_sim.ros_interfaces import Fields, Row
from palaestra_sim.scene.devices.device_type import Carrier, DevicePart, DeviceTopic, DeviceType, Sample
from palaestra_sim.scene.devices.sensor_response import Gauss, discrete
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Vector

_LOCAL: Final = 0  # the value that `get_coordinate_system` returns; WGS84 is 1
_NOWHERE: Final = (math.nan, math.nan, math.nan)


@dataclass(slots=True)
class _Speed:
    """The speed in m/s; `value` is one number, or the three of its vector."""

    value: float | Vector


@dataclass(slots=True, kw_only=True, eq=False)
class Gps:
    """A receiver; `value` is x, y, z in meters.

    Attributes:
        reference: the offset from the position in the world.
        accuracy: standard deviation of the position's noise, in meters.
        speed_noise: standard deviation of the speed's noise, as a fraction of the speed.
        speed: in m/s.
        speed_vector: in m/s, in world axes, without noise.
    """

    name: str
    model: str
    place: Frame
    reference: Vector
    accuracy: float
    resolution: float
    speed_noise: float
    speed_resolution: float
    value: Vector = _NOWHERE
    speed: _Speed = field(default_factory=lambda: _Speed(math.nan))
    speed_vector: _Speed = field(default_factory=lambda: _Speed(_NOWHERE))


def _read(part: DevicePart) -> Gps:
    system = part.world_text("gpsCoordinateSystem", "local")
    if system == "WGS84":
        part.lack("a GPS with latitude and longitude (WorldInfo.gpsCoordinateSystem)")
    x, y, z = part.world_numbers("gpsReference", (0.0, 0.0, 0.0))
    accuracy = part.number("accuracy", 0.0)
    if accuracy and part.number("noiseCorrelation", 0.0):
        part.lack("a GPS whose noise is correlated (noiseCorrelation)")
    return Gps(
        name=part.name,
        model=part.text("model"),
        place=part.place,
        reference=(x, y, z),
        accuracy=accuracy,
        resolution=part.number("resolution", -1.0),
        speed_noise=part.number("speedNoise", 0.0),
        speed_resolution=part.number("speedResolution", -1.0),
    )


def _sampler(receivers: Sequence[Gps], robot: Carrier) -> Sample:
    gauss = robot.gauss

    def sample() -> None:
        for gps in receivers:
            gps.value = _position(gps, gauss)
            velocity = robot.motion(gps.place).velocity
            gps.speed_vector.value = velocity
            gps.speed.value = _measured_speed(gps, math.hypot(*velocity), gauss)

    return sample


def _position(gps: Gps, gauss: Gauss) -> Vector:
    coordinates = []
    for exact, reference in zip(gps.place.world_position, gps.reference, strict=True):
        coordinate = exact + reference
        if gps.accuracy:
            coordinate += gps.accuracy * gauss(0.0, 1.0)
        coordinates.append(discrete(coordinate, gps.resolution))
    x, y, z = coordinates
    return x, y, z


def _measured_speed(gps: Gps, speed: float, gauss: Gauss) -> float:
    if gps.speed_noise > 0.0:
        speed *= 1.0 + gps.speed_noise * gauss(0.0, 1.0)
    return discrete(speed, gps.speed_resolution)


def _services(_gps: Gps) -> tuple[Row, ...]:
    return (
        ("get_coordinate_system", "get_int", lambda _: {"value": _LOCAL}),
        (
            "decimal_degrees_to_degrees_minutes_seconds",
            "gps_decimal_degrees_to_degrees_minutes_seconds",
            _in_degrees_minutes_seconds,
        ),
    )


def _in_degrees_minutes_seconds(request: Any) -> dict[str, Any]:
    """Round each part toward zero, as Webots does, so that all parts of a negative angle are negative."""
    angle = request.decimalDegrees
    if not math.isfinite(angle):
        angle = 0.0
    degrees = int(angle)
    minutes = int((angle - degrees) * 60)
    seconds = int(((angle - degrees) * 60 - minutes) * 60)
    return {"degreesMinutesSeconds": f"{degrees}° {minutes}\u2032 {seconds}\u2033"}


def _topics(gps: Gps) -> tuple[DeviceTopic, ...]:
    point = "geometry_msgs/PointStamped"
    # Webots leaves the frame_id of the speed empty.
    no_frame: Fields = {"header": {}}
    return (
        DeviceTopic(name="values", type_name=point, source=gps),
        DeviceTopic(
            name="speed", type_name="webots_ros/Float64Stamped", source=gps.speed, constants=no_frame
        ),
        DeviceTopic(name="speed_vector", type_name=point, source=gps.speed_vector),
    )


GPS: Final = DeviceType(
    node="GPS",
    name="gps",
    fields="""type SFString satellite; accuracy SFFloat 0; noiseCorrelation SFFloat 0;
        resolution SFFloat -1; speedNoise SFFloat 0; speedResolution SFFloat -1""",
    read=_read,
    sampler=_sampler,
    services=_services,
    topics=_topics,
)
