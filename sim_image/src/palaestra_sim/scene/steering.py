"""Relate the motion of a robot with steered wheels, such as a car, to the speeds and angles of its wheels.

The plain tires of a fixed axle permit two motions: ahead, and a turn about a point on the axle. A steered
tire must not slide sideways, which fixes the ratio of these two motions. If the angles of two steered tires
contradict each other, the drive uses the motion in which both tires slide least. The speeds of the driven
tires then give the speed of the robot by least squares, whichever axle is driven.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from palaestra_sim.scene.motors import Motor
from palaestra_sim.scene.wheel_kinematics import Direction, Twist, Wheel

_PARALLEL: Final = 0.05  # largest sine of the angle between parallel tires: 2.9 degrees
_LEAST_GAIN: Final = 1e-3  # driven tires that roll less than this, in m per m driven, do not move the robot
_LEAST_ARM_M: Final = 1e-3  # least distance from the fixed axle to the farthest steered tire


class Steer:
    """The joint that steers a tire: its axis is vertical in the robot's frame.

    Args:
        motor: the motor of the joint; the motor's angle is the angle of the joint.
        start_rad: the joint's angle at which the tire has the same pose as in the world file.
        pivot: x and y of the axis, in meters.
        up: 1 if a positive angle turns to the left, -1 if it turns to the right.
    """

    __slots__ = ("_start_rad", "_up", "motor", "pivot")

    def __init__(self, motor: Motor, start_rad: float, pivot: Direction, up: float) -> None:
        self.motor = motor
        self._start_rad = start_rad
        self._up = up
        self.pivot = pivot

    @property
    def angle_rad(self) -> float:
        """The angle in radians by which the tire is turned to the left of its pose in the world file."""
        return self._up * (self.motor.angle_rad - self._start_rad)


@dataclass(frozen=True, slots=True, kw_only=True)
class Tire:
    """A plain tire on the floor.

    Attributes:
        wheel: the tire's position, axle and radius in the world file.
        driven: whether a motor turns the tire.
        steer: the joint that steers the tire; None on a fixed axle.
    """

    wheel: Wheel
    driven: bool
    steer: Steer | None = None

    def placed(self, angle_rad: float) -> tuple[float, float, Direction]:
        """Return x and y of the hub, and the direction in which the tire rolls, at a steering angle."""
        x, y, (ahead, aside) = self.wheel.x_m, self.wheel.y_m, self.wheel.forward
        if self.steer is None:
            return x, y, (ahead, aside)
        c, s = math.cos(angle_rad), math.sin(angle_rad)
        px, py = self.steer.pivot
        x, y = x - px, y - py
        return px + c * x - s * y, py + s * x + c * y, (c * ahead - s * aside, s * ahead + c * aside)


class SteeredDrive:
    """The motion of a robot as a function of the speeds of its driven tires, at the current steering angles.

    Attributes:
        freedoms: 2, because the robot drives ahead and turns.
        to_twist: as in `Drive`, at the current angles.
        to_speeds: as in `Drive`, at the current angles.
    """

    __slots__ = ("_angles", "_forward", "_pivot", "_steers", "_tires", "freedoms", "to_speeds", "to_twist")

    def __init__(self, tires: Sequence[Tire], forward: Direction, pivot: Direction) -> None:
        self._tires = tuple(tires)
        self._steers = tuple(tire.steer for tire in tires)
        self._forward = forward
        self._pivot = pivot
        self._angles: tuple[float, ...] = ()
        self.freedoms = 2
        self.to_twist: tuple[Twist, ...] = ()
        self.to_speeds: tuple[Twist, ...] = ()
        self.changed()

    def changed(self) -> bool:
        """Read the current angles; return whether they have changed since the previous call."""
        angles = tuple(0.0 if it is None else it.angle_rad for it in self._steers)
        if angles == self._angles:
            return False
        self._angles = angles
        self._solve()
        return True

    def twist(self, speeds: Sequence[float]) -> Twist:
        """Return vx, vy in m/s and omega in rad/s of the robot's origin, from speeds in rad/s."""
        rows = list(zip(self.to_twist, speeds, strict=True))
        vx, vy, omega = (sum(row[axis] * speed for row, speed in rows) for axis in range(3))
        return vx, vy, omega

    def wheel_speeds(self, vx: float, vy: float, omega: float) -> tuple[float, ...]:
        """Return the speeds in rad/s at which the driven wheels roll."""
        return tuple(x * vx + y * vy + turning * omega for x, y, turning in self.to_speeds)

    def _solve(self) -> None:
        """Compute `to_twist` and `to_speeds` at the current angles."""
        placed = [tire.placed(angle) for tire, angle in zip(self._tires, self._angles, strict=True)]
        motion = self._motion([it for it, steer in zip(placed, self._steers, strict=True) if steer])
        holds = [
            (x, y, ahead, tire.wheel.radius_m)
            for (x, y, ahead), tire in zip(placed, self._tires, strict=True)
            if tire.driven
        ]
        vx, vy, omega = motion
        gains = [
            (ahead[0] * (vx - omega * y) + ahead[1] * (vy + omega * x)) / radius_m
            for x, y, ahead, radius_m in holds
        ]
        # The least squares compare rim speeds in m/s, so that a large wheel does not count more than a small
        # wheel.
        weights = [gain * hold[3] ** 2 for gain, hold in zip(gains, holds, strict=True)]
        total = sum(weight * gain for weight, gain in zip(weights, gains, strict=True))
        if total < _LEAST_GAIN**2:
            weights, total = [0.0] * len(weights), 1.0
        self.to_twist = tuple(
            (vx * weight / total, vy * weight / total, omega * weight / total) for weight in weights
        )
        self.to_speeds = tuple(
            (ahead[0] / radius_m, ahead[1] / radius_m, (ahead[1] * x - ahead[0] * y) / radius_m)
            for x, y, ahead, radius_m in holds
        )

    def _motion(self, steered: Sequence[tuple[float, float, Direction]]) -> Twist:
        """Return the motion of the robot in which the steered tires slide least, at an arbitrary speed."""
        (fx, fy), (px, py) = self._forward, self._pivot
        longest = max(math.hypot(x - px, y - py) for x, y, _ in steered)
        ahead = turning = mixed = 0.0
        for x, y, (ex, ey) in steered:
            sideways = fx * -ey + fy * ex  # this tire's sideways speed while the robot drives ahead at 1 m/s
            swung = (ex * (x - px) + ey * (y - py)) / longest
            ahead += sideways * sideways
            turning += swung * swung
            mixed += sideways * swung
        # The eigenvector of the smaller eigenvalue of ((ahead, mixed), (mixed, turning)).
        angle = 0.5 * math.atan2(2.0 * mixed, ahead - turning) + math.pi / 2.0
        speed, omega = math.cos(angle), math.sin(angle) / longest
        if speed < 0.0:
            speed, omega = -speed, -omega
        return speed * fx + omega * py, speed * fy - omega * px, omega


def find_steered_drive(tires: Sequence[Tire]) -> SteeredDrive | None:
    """Return the drive of a robot with these tires; None if it has no steered tires or no fixed axle."""
    fixed = [tire.wheel for tire in tires if tire.steer is None]
    steered = [tire for tire in tires if tire.steer is not None]
    if not fixed or not steered or not any(tire.driven for tire in tires):
        return None
    if not all(tire.wheel.plausible for tire in tires):
        return None
    fx, fy = fixed[0].forward
    if any(abs(fx * wheel.forward[1] - fy * wheel.forward[0]) > _PARALLEL for wheel in fixed):
        return None
    pivot = sum(it.x_m for it in fixed) / len(fixed), sum(it.y_m for it in fixed) / len(fixed)
    arms = (math.hypot(it.wheel.x_m - pivot[0], it.wheel.y_m - pivot[1]) for it in steered)
    return SteeredDrive(tires, (fx, fy), pivot) if max(arms) > _LEAST_ARM_M else None
