"""Relate the speeds of a robot's wheels to the robot's motion, from the positions of the wheels.

The floor holds a wheel along one direction, its grip. A plain tire grips in the direction in which it rolls.
A wheel with rollers grips along the axis of the roller that touches the floor. Each grip gives one linear
equation between the robot's motion and the speed of the wheel. `find_drive` solves these equations, exactly
or by least squares. So wheels need no names, and pairs and rows of wheels need no special cases.

- If the grips have different directions, the wheels determine the motion in all directions (omni, mecanum).
- If all grips are parallel, only plain tires resist a motion across the grips. The tires slide least if the
  robot turns about the center of all tires. So the model gives this center no speed across the grips
  (differential, skid-steer).

Two plain tires with different axles would block each other. Some worlds contain such tires nevertheless, as
models of omnidirectional wheels: a low friction along the axle replaces the rollers. So tires slide in this
model too.

In this model, a skid-steer robot turns as fast as its geometry determines. On a real floor the tires slip,
and the robot turns more slowly.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, NamedTuple

Direction = tuple[float, float]  # x and y of a unit vector in the robot's frame
Twist = tuple[float, float, float]  # vx, vy in m/s and omega in rad/s; or the coefficients of these three
Rows = tuple[Twist, Twist, Twist]

_PARALLEL: Final = 0.05  # sine of the largest angle, 3 degrees, between grips that count as parallel
_LEAST_GAIN: Final = 0.05  # minimum speed along the grip, as a fraction of the wheel's rim speed
_LEAST_VOLUME: Final = 1e-3  # normalized determinant: 1 for orthogonal equations, 0 for dependent equations
_LEAST_ARM_M: Final = 1e-3  # wheels whose longest lever arm is shorter do not turn the robot
_THREE: Final = 3
_ROUNDED: Final = 1e-3  # tolerance in m and in rad, because files round the positions of wheels
_K: Final = math.sqrt(0.75)
_COSINES: Final = (1.0, -0.5, -0.5)
_SINES: Final = (0.0, _K, -_K)
_FARTHEST_M: Final = 1e6  # larger numbers are mistakes, and would overflow


@dataclass(frozen=True, slots=True, kw_only=True)
class Wheel:
    """A driven wheel on the floor, in the robot's frame.

    Attributes:
        x_m, y_m: the position of the hub.
        axle: the axis about which a positive speed turns the wheel.
        radius_m: the distance from the hub to the floor.
        roller: the axis of the roller that touches the floor; None for a plain tire.
    """

    x_m: float
    y_m: float
    axle: Direction
    radius_m: float
    roller: Direction | None = None

    @property
    def forward(self) -> Direction:
        """The direction in which a positive speed rolls the hub."""
        return self.axle[1], -self.axle[0]

    @property
    def grip(self) -> Direction:
        """The direction in which the floor holds the wheel."""
        return self.forward if self.roller is None else self.roller

    @property
    def plausible(self) -> bool:
        """Whether every number is finite and of a realistic size."""
        numbers = (self.x_m, self.y_m, *self.axle, *self.grip)
        small = all(abs(number) <= _FARTHEST_M for number in numbers)
        return small and 1.0 / _FARTHEST_M <= self.radius_m <= _FARTHEST_M


@dataclass(frozen=True, slots=True)
class Drive:
    """Two linear functions: from a robot's wheel speeds to its motion, and from its motion to wheel speeds.

    Attributes:
        to_twist: one row per wheel: the vx, vy and omega of the robot's origin for 1 rad/s of this wheel.
        to_speeds: one row per wheel: the wheel's speed in rad/s for a vx, a vy and an omega of 1.
        freedoms: 3 if the robot can move in any direction, 2 if it rolls ahead and turns.
    """

    to_twist: tuple[Twist, ...]
    to_speeds: tuple[Twist, ...]
    freedoms: int = field(default=3, kw_only=True)

    def twist(self, speeds: Sequence[float]) -> Twist:
        """Return vx, vy in m/s and omega in rad/s of the robot's origin, from speeds in rad/s."""
        if len(speeds) == _THREE:  # the loop below would take twice as long
            (x0, y0, t0), (x1, y1, t1), (x2, y2, t2) = self.to_twist
            s0, s1, s2 = speeds
            return x0 * s0 + x1 * s1 + x2 * s2, y0 * s0 + y1 * s1 + y2 * s2, t0 * s0 + t1 * s1 + t2 * s2
        vx = vy = omega = 0.0
        for (x, y, turning), speed in zip(self.to_twist, speeds, strict=True):
            vx += x * speed
            vy += y * speed
            omega += turning * speed
        return vx, vy, omega

    def wheel_speeds(self, vx: float, vy: float, omega: float) -> tuple[float, ...]:
        """Return the speeds in rad/s at which the wheels roll; sideways sliding is ignored."""
        return tuple(x * vx + y * vy + turning * omega for x, y, turning in self.to_speeds)


@dataclass(frozen=True, slots=True)
class Ring(Drive):
    """Three omnidirectional wheels around the middle; the closed form of the equations keeps zeros exact.

    Source: Webots, projects/robots/festo/robotino3/controllers/robotino3/base.c. In that file the first wheel
    is at the rear. The rotation by `c`, `s` turns the frame of that file into the robot's frame.
    """

    radius_m: float
    distance_m: float
    c: float
    s: float

    def twist(self, speeds: Sequence[float]) -> Twist:
        """Return vx, vy in m/s and omega in rad/s of the robot's origin, from speeds in rad/s."""
        w0, w1, w2 = speeds
        x = self.radius_m * (w2 - w1) / (2.0 * _K)
        y = self.radius_m * (2.0 * w0 - w1 - w2) / 3.0
        omega = -self.radius_m * (w0 + w1 + w2) / (3.0 * self.distance_m)
        return x * self.c - y * self.s, x * self.s + y * self.c, omega


STANDING: Final = Drive((), ())  # the drive of a robot without wheels


def _ring(wheels: Sequence[Wheel]) -> Ring | None:
    """Return the drive of three wheels on radial axles, 120 degrees apart counterclockwise, else None.

    The first wheel defines the ring, and the rounded positions of the other wheels are corrected. With
    rounded positions, a robot that drives straight on would turn slightly.
    """
    if len(wheels) != _THREE or any(wheel.roller for wheel in wheels):
        return None
    first = wheels[0]
    distance_m = math.hypot(first.x_m, first.y_m)
    for wheel, c, s in zip(wheels, _COSINES, _SINES, strict=True):
        axle = first.axle[0] * c - first.axle[1] * s, first.axle[0] * s + first.axle[1] * c
        exact = replace(first, x_m=distance_m * axle[0], y_m=distance_m * axle[1], axle=axle)
        if _difference(exact, wheel) > _ROUNDED:
            return None
    c, s = -first.axle[0], -first.axle[1]
    to_speeds = tuple(
        ((x * c - y * s) / first.radius_m, (x * s + y * c) / first.radius_m, -distance_m / first.radius_m)
        for x, y in ((0.0, 1.0), (-_K, -0.5), (_K, -0.5))
    )
    return Ring((), to_speeds, first.radius_m, distance_m, c, s)


def _difference(one: Wheel, other: Wheel) -> float:
    return max(
        math.hypot(one.x_m - other.x_m, one.y_m - other.y_m),
        math.hypot(one.axle[0] - other.axle[0], one.axle[1] - other.axle[1]),
        abs(one.radius_m - other.radius_m),
    )


def find_drive(wheels: Sequence[Wheel]) -> Drive | None:
    """Return the drive of a robot with these wheels; None if the wheels cannot steer it."""
    if not wheels or not all(wheel.plausible for wheel in wheels):
        return None
    if ring := _ring(wheels):
        return ring
    common = _common([wheel.grip for wheel in wheels])
    holds = [_hold(wheel, common or wheel.grip) for wheel in wheels]
    if any(
        abs(hold.gain_m) < _LEAST_GAIN * wheel.radius_m for hold, wheel in zip(holds, wheels, strict=True)
    ):
        return None
    center = _middle(wheels)
    arms = [hold.arm(center) for hold in holds]
    if max(map(abs, arms)) < _LEAST_ARM_M:
        return None
    if common is None:
        rows = _any_direction(holds, arms)
    else:
        rows = _two_directions(common, arms)
        center = _pivot(wheels, common, center)
    if not rows:
        return None
    return Drive(
        tuple(_at_origin(row, center, hold.gain_m) for row, hold in zip(rows, holds, strict=True)),
        tuple(hold.to_speed for hold in holds),
        freedoms=3 if common is None else 2,
    )


class _Hold(NamedTuple):
    """The point and direction in which the floor holds a wheel, and the distance in m for 1 rad."""

    x: float
    y: float
    direction: Direction
    gain_m: float

    def arm(self, center: Direction) -> float:
        """Return the lever arm of the hold about a point, in meters, positive to the left."""
        return _cross((self.x - center[0], self.y - center[1]), self.direction)

    @property
    def to_speed(self) -> Twist:
        """The wheel's row of `Drive.to_speeds`."""
        x, y = self.direction
        return x / self.gain_m, y / self.gain_m, self.arm((0.0, 0.0)) / self.gain_m


def _hold(wheel: Wheel, direction: Direction) -> _Hold:
    return _Hold(wheel.x_m, wheel.y_m, direction, wheel.radius_m * _dot(direction, wheel.forward))


def _common(grips: Sequence[Direction]) -> Direction | None:
    """Return the direction of parallel grips, which may be opposite; None if they differ."""
    first = grips[0]
    if any(abs(_cross(first, grip)) > _PARALLEL for grip in grips):
        return None
    signs = [math.copysign(1.0, _dot(first, grip)) for grip in grips]
    x = math.fsum(sign * grip[0] for sign, grip in zip(signs, grips, strict=True))
    y = math.fsum(sign * grip[1] for sign, grip in zip(signs, grips, strict=True))
    length = math.hypot(x, y)
    return (x / length, y / length) if length else None


def _two_directions(forward: Direction, arms: Sequence[float]) -> list[Twist]:
    """Return the motion for 1 m/s of each hold, for wheels that roll forward and turn."""
    count = len(arms)
    squares = math.fsum(arm * arm for arm in arms)
    return [(forward[0] / count, forward[1] / count, arm / squares) for arm in arms]


def _any_direction(holds: Sequence[_Hold], arms: Sequence[float]) -> list[Twist]:
    """Return the motion for 1 m/s of each hold; an empty list if the holds do not determine it.

    The rotation is scaled by the longest arm, so that all three unknowns are speeds of similar size.
    """
    longest = max(map(abs, arms))
    rows = [(*hold.direction, arm / longest) for hold, arm in zip(holds, arms, strict=True)]
    columns = list(zip(*rows, strict=True))
    squares = _rows((_product(a, b) for b in columns) for a in columns)
    size = (squares[0][0] + squares[1][1] + squares[2][2]) / 3.0
    if _determinant(squares) < _LEAST_VOLUME * size**3:
        return []
    if len(rows) == len(columns):  # the inverse of a square matrix keeps mirrored wheels exactly symmetric
        solved = list(zip(*_inverse(_rows(rows)), strict=True))
    else:
        inverse = _inverse(squares)
        solved = [_row(_product(line, row) for line in inverse) for row in rows]
    return [(vx, vy, turning / longest) for vx, vy, turning in solved]


def _middle(wheels: Sequence[Wheel]) -> Direction:
    """Return x and y in meters of the wheels' centroid."""
    count = len(wheels)
    return math.fsum(wheel.x_m for wheel in wheels) / count, math.fsum(wheel.y_m for wheel in wheels) / count


def _pivot(wheels: Sequence[Wheel], forward: Direction, middle: Direction) -> Direction:
    """Return the point without lateral speed.

    It is the middle of all wheels, moved along `forward` until it is level with the plain tires.
    """
    plain = [wheel for wheel in wheels if wheel.roller is None]
    if not plain:
        return middle
    x, y = _middle(plain)
    ahead = _dot(forward, (x - middle[0], y - middle[1]))
    return middle[0] + ahead * forward[0], middle[1] + ahead * forward[1]


def _at_origin(row: Twist, center: Direction, gain_m: float) -> Twist:
    """Return the motion of the origin for 1 rad/s of a wheel; `row` is for 1 m/s of its hold at `center`."""
    vx, vy, omega = row
    return (vx + omega * center[1]) * gain_m, (vy - omega * center[0]) * gain_m, omega * gain_m


def _dot(a: Direction, b: Direction) -> float:
    return a[0] * b[0] + a[1] * b[1]


def _cross(a: Direction, b: Direction) -> float:
    return a[0] * b[1] - a[1] * b[0]


def _product(a: Iterable[float], b: Iterable[float]) -> float:
    """Return the sum of the products, rounded once, so that mirrored wheels cancel exactly."""
    return math.fsum(x * y for x, y in zip(a, b, strict=True))


def _normal(a: Twist, b: Twist) -> Twist:
    """Return the cross product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _determinant(rows: Rows) -> float:
    return _product(rows[0], _normal(rows[1], rows[2]))


def _inverse(rows: Rows) -> Rows:
    a, b, c = rows
    volume = _determinant(rows)
    columns = (_normal(b, c), _normal(c, a), _normal(a, b))
    return _rows((x / volume, y / volume, z / volume) for x, y, z in zip(*columns, strict=True))


def _row(numbers: Iterable[float]) -> Twist:
    a, b, c = numbers
    return a, b, c


def _rows(lines: Iterable[Iterable[float]]) -> Rows:
    a, b, c = map(_row, lines)
    return a, b, c
