"""GPS: the position of the sensor in meters or in degrees, and its speed.

In the coordinate system "local", the position is the position in the world plus WorldInfo.gpsReference. In
the system "WGS84", the reference and the position are latitude and longitude in degrees and altitude in
meters. Noise and resolution are in meters in both systems. Source: WbGps.cpp of Webots.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from palaestra_sim.ros_interfaces import Fields, Row
from palaestra_sim.scene.devices.device_type import Carrier, DevicePart, DeviceTopic, DeviceType, Sample
from palaestra_sim.scene.devices.sensor_response import Gauss, discrete
from palaestra_sim.scene.devices.step_timer import StepTimer
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Vector
from palaestra_sim.scene.utm import UtmZone

_LOCAL, _WGS84 = 0, 1  # the values that `get_coordinate_system` returns
_GPS_SERVICE = 1  # SERVICE_GPS of sensor_msgs/NavSatStatus
_NOWHERE: Final = (math.nan, math.nan, math.nan)
_MOST_LATITUDE, _MOST_LONGITUDE = 84.0, 180.0  # in degrees; in the north, the zones of UTM end here


@dataclass(slots=True)
class _Speed:
    """The speed in m/s; `value` is a number, or a vector of three numbers."""

    value: float | Vector


@dataclass(frozen=True, slots=True)
class _Globe:
    """A UTM zone, and the axes of the world that point east, north and up."""

    zone: UtmZone
    axes: tuple[int, int, int]

    def in_meters(self, latitude: float, longitude: float, altitude_m: float) -> Vector:
        """Return a point in the axes of the world."""
        east, north, up = self.axes
        x_y_z = [0.0, 0.0, 0.0]
        x_y_z[up] = altitude_m
        x_y_z[east], x_y_z[north] = self.zone.to_grid(latitude, longitude)
        return x_y_z[0], x_y_z[1], x_y_z[2]

    def in_degrees(self, point: Vector) -> Vector:
        """Return latitude, longitude and altitude of a point in the axes of the world."""
        east, north, up = self.axes
        return *self.zone.to_degrees(point[east], point[north]), point[up]


@dataclass(slots=True, kw_only=True, eq=False)
class Gps:
    """A GPS receiver; `value` is x, y, z in meters, or latitude, longitude and altitude.

    Attributes:
        reference: the offset from the position in the world, in meters.
        globe: the conversion between meters and degrees; None in the system "local".
        accuracy: standard deviation of the position's noise, in meters.
        correlation: the share of the noise that is left after a second.
        speed_noise: standard deviation of the speed's noise, as a fraction of the speed.
        speed: the speed in m/s.
        speed_vector: the velocity in m/s, in world axes, without noise.
    """

    name: str
    model: str
    place: Frame
    reference: Vector
    globe: _Globe | None = None
    accuracy: float
    correlation: float = 0.0
    resolution: float
    speed_noise: float
    speed_resolution: float
    value: Vector = _NOWHERE
    speed: _Speed = field(default_factory=lambda: _Speed(math.nan))
    speed_vector: _Speed = field(default_factory=lambda: _Speed(_NOWHERE))


def _read(part: DevicePart) -> Gps:
    reference, globe = _reference(part)
    return Gps(
        name=part.name,
        model=part.text("model"),
        place=part.place,
        reference=reference,
        globe=globe,
        accuracy=part.number("accuracy", 0.0),
        correlation=part.number("noiseCorrelation", 0.0),
        resolution=part.number("resolution", -1.0),
        speed_noise=part.number("speedNoise", 0.0),
        speed_resolution=part.number("speedResolution", -1.0),
    )


def _reference(part: DevicePart) -> tuple[Vector, _Globe | None]:
    x, y, z = part.world_numbers("gpsReference", (0.0, 0.0, 0.0))
    if part.world_text("gpsCoordinateSystem", "local") != "WGS84":
        return (x, y, z), None
    if not (abs(x) <= _MOST_LATITUDE and abs(y) <= _MOST_LONGITUDE):
        part.refuse(
            f"gpsReference {x:g} {y:g}",
            f"use at most {_MOST_LATITUDE:g} degrees of latitude and {_MOST_LONGITUDE:g} of longitude",
        )
        x = y = 0.0
    globe = _Globe(UtmZone.of(x, y), (part.axis_to("E"), part.axis_to("N"), part.axis_to("U")))
    return globe.in_meters(x, y, z), globe


def _sampler(receivers: Sequence[Gps], robot: Carrier) -> Sample:
    samples = [_receiver(gps, robot) for gps in receivers]

    def sample() -> None:
        for each in samples:
            each()

    return sample


def _receiver(gps: Gps, robot: Carrier) -> Sample:
    timer, gauss = StepTimer(robot), robot.gauss
    noise = [0.0, 0.0, 0.0]  # the noise of each axis, in standard deviations

    def sample() -> None:
        elapsed_s, reset = timer.elapsed()
        if reset:
            noise[:] = 0.0, 0.0, 0.0
        if gps.accuracy:
            kept = gps.correlation**elapsed_s if gps.correlation else 0.0
            new = math.sqrt(1.0 - kept**2)
            noise[:] = (kept * it + new * gauss(0.0, 1.0) for it in noise)
        gps.value = _position(gps, noise)
        velocity = robot.motion(gps.place).velocity
        gps.speed_vector.value = velocity
        gps.speed.value = _measured_speed(gps, math.hypot(*velocity), gauss)

    return sample


def _position(gps: Gps, noise: Sequence[float]) -> Vector:
    places = zip(gps.place.world_position, gps.reference, noise, strict=True)
    x, y, z = (discrete(exact + at + gps.accuracy * by, gps.resolution) for exact, at, by in places)
    return (x, y, z) if gps.globe is None else gps.globe.in_degrees((x, y, z))


def _measured_speed(gps: Gps, speed: float, gauss: Gauss) -> float:
    if gps.speed_noise > 0.0:
        speed *= 1.0 + gps.speed_noise * gauss(0.0, 1.0)
    return discrete(speed, gps.speed_resolution)


def _services(gps: Gps) -> tuple[Row, ...]:
    system = _LOCAL if gps.globe is None else _WGS84
    return (
        ("get_coordinate_system", "get_int", lambda _: {"value": system}),
        (
            "decimal_degrees_to_degrees_minutes_seconds",
            "gps_decimal_degrees_to_degrees_minutes_seconds",
            _in_degrees_minutes_seconds,
        ),
    )


def _in_degrees_minutes_seconds(request: Any) -> dict[str, Any]:
    """Return degrees, minutes and seconds, rounded toward zero as in Webots; all have the angle's sign."""
    angle = request.decimalDegrees
    if not math.isfinite(angle):
        angle = 0.0
    degrees = int(angle)
    minutes = int((angle - degrees) * 60)
    seconds = int(((angle - degrees) * 60 - minutes) * 60)
    return {"degreesMinutesSeconds": f"{degrees}° {minutes}\u2032 {seconds}\u2033"}


@dataclass(frozen=True, slots=True)
class _Fix:
    """The position of a GPS in degrees; `value` has the fields of sensor_msgs/NavSatFix."""

    gps: Gps

    @property
    def value(self) -> Fields:
        latitude, longitude, altitude = self.gps.value
        return {
            "status": {"service": _GPS_SERVICE},
            "latitude": latitude,
            "longitude": longitude,
            "altitude": altitude,
        }


def _topics(gps: Gps) -> tuple[DeviceTopic, ...]:
    point = "geometry_msgs/PointStamped"
    values = DeviceTopic(name="values", type_name=point, source=gps)
    if gps.globe is not None:
        values = DeviceTopic(name="values", type_name="sensor_msgs/NavSatFix", source=_Fix(gps), whole=True)
    # Webots leaves the frame_id of the speed empty.
    no_frame: Fields = {"header": {}}
    return (
        values,
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
