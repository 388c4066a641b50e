"""Radar: distances and speeds of the Solids with a `radarCrossSection` in the radar's field of view.

A speed is the change of position since the previous sample, so it is 0 in the first sample. With the default
limits, Webots detects only targets that move away at 1 to 2 m/s. If both limits are 0, a target may have any
speed. Source: WbRadar.cpp of Webots.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Final

from palaestra_sim.ros_interfaces import Fields, Row
from palaestra_sim.scene.devices.device_type import Carrier, DevicePart, DeviceTopic, DeviceType, Sample
from palaestra_sim.scene.devices.step_timer import StepTimer
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Vector
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.old_axes import looking
from palaestra_sim.scene.outlines import robot_around
from palaestra_sim.scene.radar_targets import Bounds, RadarTarget, RadarTargets

_LIGHT_M_S: Final = 299_792_458.0
_MILLIWATT: Final = 0.001
_NEAREST_M: Final = 0.001  # minimum distance in the formula of the power; at 0 m the power would be infinite
_Gauss = Callable[[float, float], float]


@dataclass(frozen=True, slots=True, kw_only=True)
class RadarLimits:
    """The limits of a radar's detection.

    Attributes:
        range_m: minimum and maximum distance of a target.
        field_of_view_rad: horizontal and vertical angle of view.
        radial_m_s: minimum and maximum speed at which a target moves away; None for any speed.
        absolute_m_s: minimum speed, in either direction.
        cell: two targets are merged if their distances differ by less than the first number, in m, and their
            speeds by less than the second number, in m/s. If the second number is 0, speeds are not compared.
        power_w: the weakest detectable signal.
        noise: standard deviations of distance in m, speed in m/s and azimuth in rad.
    """

    range_m: tuple[float, float]
    field_of_view_rad: tuple[float, float]
    radial_m_s: tuple[float, float] | None
    absolute_m_s: float
    cell: tuple[float, float]
    power_w: float
    noise: tuple[float, float, float]

    def accept(self, speed: float) -> bool:
        """Return whether the radar detects a target that moves away at a speed in m/s."""
        if self.radial_m_s is not None and not self.radial_m_s[0] <= speed <= self.radial_m_s[1]:
            return False
        return abs(speed) >= self.absolute_m_s


@dataclass(frozen=True, slots=True)
class Echo:
    """One detected target, in meters, watts, m/s and rad; an azimuth to the right is positive."""

    distance: float
    power_w: float
    speed: float
    azimuth: float

    def message(self) -> Fields:
        """Return the target as a message, with the power in dBm."""
        power_dbm = 10.0 * math.log10(self.power_w / _MILLIWATT)
        return {
            "distance": self.distance,
            "receivedPower": power_dbm,
            "speed": self.speed,
            "azimuth": self.azimuth,
        }


@dataclass(slots=True, kw_only=True, eq=False)
class Radar:
    """A radar.

    Attributes:
        place: the frame of the radar; the radar looks along the x axis of this frame.
        node: the node of the device.
        limits: distances, angles, speeds and powers at which the radar detects a target.
        gain_w_m2: the power reflected by 1 m2 at a distance of 1 m.
        occlusion: whether shapes hide targets.
        seen: the targets of the last sample.
    """

    name: str
    model: str
    node: SceneNode
    place: Frame
    limits: RadarLimits
    gain_w_m2: float
    occlusion: bool
    seen: list[Echo] = field(default_factory=list)
    _echoes: RadarTargets = field(default_factory=RadarTargets)
    _robot: frozenset[SceneNode] = frozenset()
    _enabled: bool = False
    _before: dict[Frame, Vector] = field(default_factory=dict)

    @property
    def value(self) -> list[Fields]:
        """The targets of the last sample, as messages."""
        return [echo.message() for echo in self.seen]

    def show(self, echoes: RadarTargets) -> None:
        """Set the targets of the world."""
        self._echoes = echoes
        self._robot = robot_around(self.node)

    def enabled(self, period_ms: int) -> None:
        """Start or stop sampling."""
        self._enabled = period_ms > 0
        self._before = {}
        self.seen = []

    def sample(self, gauss: _Gauss, passed_s: float) -> None:
        """Detect the current targets if the radar is enabled.

        Args:
            gauss: draws the noise.
            passed_s: simulated seconds since the last sample; 0 after a reset, so that no target has a speed.
        """
        if not self._enabled:
            return
        targets = [it for it in self._echoes.targets if it.place is not self.place]
        echoes = (self._echo(target, passed_s, gauss) for target in targets)
        self.seen = merged([echo for echo in echoes if echo is not None], self.limits.cell)
        places = (self.place, *(target.place for target in targets))
        self._before = {place: place.ground_pose.position for place in places}

    def _echo(self, target: RadarTarget, passed_s: float, gauss: _Gauss) -> Echo | None:
        """Return a target in its current state; None if it is not detected."""
        limits = self.limits
        radar = self.place.ground_pose
        bounds = target.seen_from(radar, limits.field_of_view_rad)
        if bounds is None or self._hidden(target, radar.position, bounds):
            return None
        distance = self._distance(bounds, gauss)
        if distance is None:
            return None
        power_w = self.gain_w_m2 * target.cross_section_m2 / max(distance, _NEAREST_M) ** 4
        speed = self._speed(target.place, passed_s) + _noise(limits.noise[1], gauss)
        if power_w < limits.power_w or not limits.accept(speed):
            return None
        x, y, _ = radar.inverse.carry(target.place.ground_pose.position)
        edge = limits.field_of_view_rad[0] / 2.0
        azimuth = max(-edge, min(edge, -math.atan2(y, x))) + _noise(limits.noise[2], gauss)
        return Echo(distance, power_w, speed, azimuth)

    def _hidden(self, target: RadarTarget, eye: Vector, bounds: Bounds) -> bool:
        """Return whether a shape is in front of the target by more than half of the target's depth."""
        if not self.occlusion:
            return False
        free = self._echoes.free_path(target, eye, self._robot)
        return math.dist(eye, target.place.ground_pose.position) - free > bounds.size[0] / 2.0

    def _distance(self, bounds: Bounds, gauss: _Gauss) -> float | None:
        """Return the reported distance of a target; None if it is too near or too far."""
        low, high = self.limits.range_m
        distance, slack = math.hypot(*bounds.middle), bounds.size[0] / 2.0
        if distance > high + slack:
            return None
        distance += _noise(self.limits.noise[0], gauss)
        return None if distance < low - slack else max(low, min(high, distance))

    def _speed(self, place: Frame, passed_s: float) -> float:
        """Return the speed at which a target moves away; 0 if the target has no previous sample."""
        if passed_s <= 0.0 or place not in self._before or self.place not in self._before:
            return 0.0
        now = place.ground_pose.position, self.place.ground_pose.position
        before = self._before[place], self._before[self.place]
        way = [a - b for a, b in zip(*now, strict=True)]
        moved = [a - b - (c - d) for a, b, c, d in zip(now[0], before[0], now[1], before[1], strict=True)]
        return sum(a * b for a, b in zip(way, moved, strict=True)) / (math.hypot(*way) or 1.0) / passed_s


def merged(echoes: Sequence[Echo], cell: tuple[float, float]) -> list[Echo]:
    """Return the targets; the targets in one cell become their mean, weighted by their powers."""
    rest = list(echoes)
    at = 0
    while cell[0] > 0.0 and at < len(rest):
        first = rest[at]
        near = [
            it
            for it in rest[at + 1 :]
            if abs(it.distance - first.distance) < cell[0]
            and (cell[1] <= 0.0 or abs(it.speed - first.speed) < cell[1])
        ]
        if near:
            rest[at:] = [_mean([first, *near]), *(it for it in rest[at + 1 :] if it not in near)]
        else:
            at += 1
    return rest


def _mean(echoes: Sequence[Echo]) -> Echo:
    power_w = sum(it.power_w for it in echoes)
    distance, speed, azimuth = (
        sum(getattr(it, name) * it.power_w for it in echoes) / power_w
        for name in ("distance", "speed", "azimuth")
    )
    return Echo(distance, power_w, speed, azimuth)


def _noise(deviation: float, gauss: _Gauss) -> float:
    return gauss(0.0, deviation) if deviation > 0.0 else 0.0


@dataclass(frozen=True, slots=True, eq=False)
class _Count:
    """The number of targets."""

    radar: Radar

    @property
    def value(self) -> int:
        return len(self.radar.seen)


def _read(part: DevicePart) -> Radar:
    number = part.number
    wavelength_m = _LIGHT_M_S / (number("frequency", 24.0) or 24.0) / 1e9
    gain = 10.0 ** (number("antennaGain", 20.0) / 10.0)
    return Radar(
        name=part.name,
        model=part.text("model"),
        node=part.node,
        place=looking(part.node, part.place),
        limits=_limits(part),
        gain_w_m2=_watts(number("transmittedPower", 1.0)) * (gain * wavelength_m) ** 2 / (4.0 * math.pi) ** 3,
        occlusion=part.node.flag("occlusion", False),
    )


def _limits(part: DevicePart) -> RadarLimits:
    """Return the limits of a radar; an empty range is replaced as in Webots."""
    number = part.number
    low, high = number("minRange", 1.0), number("maxRange", 50.0)
    if high <= low:
        low, high = (low, low + 1.0) if high <= 0.0 else (max(0.0, high - 1.0), high)
    slowest, fastest = number("minRadialSpeed", 1.0), number("maxRadialSpeed", -1.0)
    limited = bool(slowest or fastest)
    return RadarLimits(
        range_m=(low, high),
        field_of_view_rad=(number("horizontalFieldOfView", 0.78), number("verticalFieldOfView", 0.1)),
        radial_m_s=(slowest, fastest if fastest > slowest else slowest + 1.0) if limited else None,
        absolute_m_s=number("minAbsoluteRadialSpeed", 0.0),
        cell=(number("cellDistance", 0.0), number("cellSpeed", 0.0)),
        power_w=_watts(number("minDetectableSignal", -100.0)),
        noise=(number("rangeNoise", 0.0), number("speedNoise", 0.0), number("angularNoise", 0.0)),
    )


def _watts(power_dbm: float) -> float:
    return _MILLIWATT * math.pow(10.0, power_dbm / 10.0)


def _sampler(radars: Sequence[Radar], robot: Carrier) -> Sample:
    timer, gauss = StepTimer(robot), robot.gauss

    def sample() -> None:
        elapsed_s, reset = timer.elapsed()
        for radar in radars:
            radar.sample(gauss, 0.0 if reset else elapsed_s)

    return sample


def _services(radar: Radar) -> tuple[Row, ...]:
    (low, high), (across, up) = radar.limits.range_m, radar.limits.field_of_view_rad
    answers = {
        "get_min_range": low,
        "get_max_range": high,
        "get_vertical_fov": up,
        "get_horizontal_fov": across,
    }
    return tuple(
        (name, "get_float", lambda _, value=value: {"value": value}) for name, value in answers.items()
    )


def _topics(radar: Radar) -> tuple[DeviceTopic, ...]:
    return (
        DeviceTopic(name="targets", type_name="webots_ros/RadarTarget", source=radar, many=True, whole=True),
        DeviceTopic(name="number_of_targets", type_name="webots_ros/Int8Stamped", source=_Count(radar)),
    )


RADAR: Final = DeviceType(
    node="Radar",
    name="radar",
    fields="""minRange SFFloat 1; maxRange SFFloat 50; horizontalFieldOfView SFFloat 0.78;
        verticalFieldOfView SFFloat 0.1; minAbsoluteRadialSpeed SFFloat 0; minRadialSpeed SFFloat 1;
        maxRadialSpeed SFFloat -1; cellDistance SFFloat 0; cellSpeed SFFloat 0; rangeNoise SFFloat 0;
        speedNoise SFFloat 0; angularNoise SFFloat 0; antennaGain SFFloat 20; frequency SFFloat 24;
        transmittedPower SFFloat 1; minDetectableSignal SFFloat -100; occlusion SFBool FALSE""",
    read=_read,
    sampler=_sampler,
    services=_services,
    topics=_topics,
    enabled=Radar.enabled,
)
