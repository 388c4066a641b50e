"""Find the parts that may drive a robot: hinges with motors and a round end, and the belts of tracks.

A wheel is found by its geometry: a level axle, and a round end that has its center on the axle and reaches
the floor. A belt counts as a wheel in the middle of the track. The rim of this wheel moves as many meters as
the motor of the track.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, TypeVar

from palaestra_sim.scene.geometry import Vector
from palaestra_sim.scene.motors import Motor
from palaestra_sim.scene.shapes import Shape
from palaestra_sim.scene.steering import Steer
from palaestra_sim.scene.wheel_kinematics import Wheel

_LEVEL: Final = 1e-3  # sine of the largest angle between the floor and an axle that counts as level
_OFF_CENTER: Final = 0.2  # tolerance from center to axle and from rim to floor, in wheel radii


@dataclass(slots=True, kw_only=True)
class Rolling:
    """A hinge or a track, which may be a wheel, in the robot's frame.

    Attributes:
        anchor: a point on the axle; for a track, the track's origin.
        shape: the round end; for a track, the lowest shape of the track.
        roller: the axis of the roller that touches the floor; None for a plain tire or a belt.
        belt: whether the part is a track.
        steer: the joint that steers the wheel; None on a fixed axle.
    """

    axle: Vector
    anchor: Vector
    shape: Shape
    roller: Vector | None = None
    belt: bool = False
    steer: Steer | None = None

    @property
    def bottom(self) -> float:
        """Z of the lower end of the shape."""
        return self.shape.heights()[0] if self.belt else self.shape.pose.position[2] - self.radius

    @property
    def top(self) -> float:
        """Z of the upper end of the shape."""
        return self.bottom + 2.0 * self.radius

    @property
    def radius(self) -> float:
        """Half the height of the part that touches the floor."""
        low, high = self.shape.heights()
        return (high - low) / 2.0 if self.belt else self.shape.size[0] / 2.0

    @property
    def turns_level(self) -> bool:
        """Whether the end turns about a level axle through its center."""
        fits = abs(self.axle[2]) < _LEVEL and self.radius > 0.0
        return fits and (self.belt or self._turns_about_its_center())

    def wheel(self) -> Wheel:
        """Return the hinge or track as a wheel on the floor."""
        x, y, _ = self.anchor if self.belt else self.shape.pose.position
        return Wheel(
            x_m=x,
            y_m=y,
            axle=_level(self.axle),
            radius_m=1.0 if self.belt else self.radius,
            roller=None if self.roller is None else _level(self.roller),
        )

    def _turns_about_its_center(self) -> bool:
        center = self.shape.pose.position
        offset = (center[0] - self.anchor[0], center[1] - self.anchor[1], center[2] - self.anchor[2])
        along = sum(a * b for a, b in zip(offset, self.axle, strict=True))
        square = sum(part * part for part in offset) - along * along
        return math.sqrt(max(0.0, square)) <= _OFF_CENTER * self.radius


@dataclass(slots=True, kw_only=True)
class Driven(Rolling):
    """A hinge or a track with a motor."""

    motor: Motor

    def may_drive(self) -> bool:
        """Return whether the end turns without stops about a level axle through its center."""
        stops = self.motor.spec.stops
        return stops[0] == stops[1] and self.turns_level


_Wheel = TypeVar("_Wheel", bound=Rolling)


def wheels_among(driven: Sequence[Driven]) -> list[Driven]:
    """Return the parts that can drive the robot and reach down to the floor."""
    return _lowest([found for found in driven if found.may_drive()])


def tires_among(driven: Sequence[Driven], idle: Sequence[Rolling]) -> list[Rolling]:
    """Return the plain wheels on the floor, including those without a motor."""
    possible = [*(found for found in driven if found.may_drive()), *(it for it in idle if it.turns_level)]
    return [found for found in _lowest(possible) if found.roller is None and not found.belt]


def _lowest(wheels: Sequence[_Wheel]) -> list[_Wheel]:
    """Return the wheels that reach down to the floor."""
    floor = min((found.bottom for found in wheels), default=0.0)
    return [found for found in wheels if found.bottom <= floor + _OFF_CENTER * found.radius]


def _level(vector: Vector) -> tuple[float, float]:
    """Return the direction of a vector on the floor."""
    length = math.hypot(vector[0], vector[1]) or 1.0
    return vector[0] / length, vector[1] / length
