"""The law by which wheels move a robot, found from where they stand and how they roll.

A wheel at p that turns at w about its axle a moves its hub by w r along d = a x z. Rollers let it slip. It
then holds the floor only along the axis e of the roller that touches it: for an omnidirectional wheel e is d,
for a Mecanum wheel it is between d and a. So each wheel gives one equation for the velocity (vx, vy, omega):

    e . (v + omega x p) = (e . d) r w

Three independent equations are an omnidirectional drive. If all plain wheels roll the same way, their tires
add one: the middle of the wheels does not move sideways. That is a differential drive, or with four wheels
and more a skid-steer, which slips as it turns. More wheels than needed are averaged by least squares.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from operator import mul
from typing import Final

Twist = tuple[float, float, float]  # vx, vy in m/s and omega in rad/s
Row = tuple[float, float, float]

_INDEPENDENT: Final = 1e-6  # of the determinant of normalized equations
_PARALLEL: Final = 1e-3  # the sine of the angle between two axles that count as parallel


@dataclass(frozen=True, slots=True, kw_only=True)
class Wheel:
    """A driven wheel, in the frame of its robot.

    Attributes:
        x_m, y_m: of its hub.
        axle: unit vector, level, about which a positive speed turns the wheel.
        radius_m: of the wheel.
        roller: unit vector of the axis of the roller on the floor; None for a tire.
    """

    x_m: float
    y_m: float
    axle: tuple[float, float]
    radius_m: float
    roller: tuple[float, float] | None = None

    @property
    def forward(self) -> tuple[float, float]:
        """The direction in which the hub moves at a positive speed."""
        return self.axle[1], -self.axle[0]

    def row(self, direction: tuple[float, float]) -> Row:
        """Return the speed of the hub along a direction, as coefficients of vx, vy and omega."""
        ex, ey = direction
        return ex, ey, ey * self.x_m - ex * self.y_m


@dataclass(frozen=True, slots=True)
class Drive:
    """The law of one robot, linear in both directions.

    Attributes:
        forward: three rows, one coefficient a wheel: from the wheels' speeds to vx, vy, omega.
        backward: a row a wheel: from vx, vy, omega to its speed.
    """

    forward: tuple[tuple[float, ...], ...]
    backward: tuple[Row, ...]

    def twist(self, speeds: Sequence[float]) -> Twist:
        """Return vx, vy in m/s and omega in rad/s from the wheels' speeds in rad/s."""
        vx, vy, omega = (_dot(row, speeds) for row in self.forward)
        return vx, vy, omega

    def wheel_speeds(self, vx: float, vy: float, omega: float) -> list[float]:
        """Return the wheels' speeds in rad/s for a twist that the robot can have."""
        return [row[0] * vx + row[1] * vy + row[2] * omega for row in self.backward]


def find_drive(wheels: Sequence[Wheel]) -> Drive | None:
    """Return the law of these wheels; None if they do not determine how the robot moves."""
    rolling = [(wheel, wheel.roller or wheel.forward) for wheel in wheels]
    gains = [wheel.radius_m * _dot(held, wheel.forward) for wheel, held in rolling]
    if not wheels or min(map(abs, gains)) == 0.0:
        return None
    rows = [wheel.row(held) for wheel, held in rolling]
    sideways = _sideways(wheels)
    inverse = _inverse([*rows, *sideways])
    if inverse is None:
        return None
    forward = tuple(
        tuple(_dot(line, row) * gain for row, gain in zip(rows, gains, strict=True)) for line in inverse
    )
    backward = tuple(
        (row[0] / gain, row[1] / gain, row[2] / gain) for row, gain in zip(rows, gains, strict=True)
    )
    return Drive(forward, backward)


def _sideways(wheels: Sequence[Wheel]) -> list[Row]:
    """Return the equation of tires that all roll the same way: their middle does not move sideways."""
    first = wheels[0].axle
    if any(it.roller or abs(first[0] * it.axle[1] - first[1] * it.axle[0]) > _PARALLEL for it in wheels):
        return []
    x = sum(wheel.x_m for wheel in wheels) / len(wheels)
    y = sum(wheel.y_m for wheel in wheels) / len(wheels)
    return [(first[0], first[1], first[1] * x - first[0] * y)]


def _inverse(rows: Sequence[Row]) -> list[Row] | None:
    """Return (A'A)^-1 for the equations A, so that (A'A)^-1 A' solves them; None if they are dependent."""
    reach = max(abs(row[2]) for row in rows)
    if reach == 0.0:
        return None
    scaled = [(row[0], row[1], row[2] / reach) for row in rows]
    n = [[sum(row[i] * row[j] for row in scaled) / len(rows) for j in range(3)] for i in range(3)]
    cofactors = [
        [
            n[(j + 1) % 3][(i + 1) % 3] * n[(j + 2) % 3][(i + 2) % 3]
            - n[(j + 1) % 3][(i + 2) % 3] * n[(j + 2) % 3][(i + 1) % 3]
            for j in range(3)
        ]
        for i in range(3)
    ]
    determinant = sum(n[0][j] * cofactors[j][0] for j in range(3))
    if determinant < _INDEPENDENT:
        return None
    scale = (1.0, 1.0, 1.0 / reach)
    lines = [
        [cofactors[i][j] / determinant / len(rows) * scale[i] * scale[j] for j in range(3)] for i in range(3)
    ]
    return [(line[0], line[1], line[2]) for line in lines]


def _dot(a: Sequence[float], b: Sequence[float]) -> float:
    return float(sum(map(mul, a, b)))
