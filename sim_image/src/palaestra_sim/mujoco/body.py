"""The base of a robot in MuJoCo: one body with three joints (x, y, heading), which three servos move.

The servos act along the axes of the robot, and their forces are limited. In each basic step, the wheel
kinematics set the target speeds of the servos. The wheels themselves have no contacts. A simulation of wheels
by rollers or capsules takes up to 28 times as long, and robots drift by decimeters (docs/decisions/0017).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from operator import add, sub
from typing import Any, Final

from palaestra_sim.scene.bodies import Build
from palaestra_sim.scene.mobile_base import ACCELERATIONS
from palaestra_sim.scene.shapes import Shape

X, Y, HEADING = 0, 1, 2  # indices of the three joints
_REST: Final = (0.0, 0.0, 0.0)


class MujocoBody:
    """A robot that drives; see `Body`.

    Attributes:
        build: the parts of the robot.
        base: the wheels of the robot.
        poses: the pose of each shape of the outline, in the robot's frame.
        radius_m: the radius of the circle around the outline.
        rim, x, y, heading_rad, c, s, velocity, touched: see `Body`.
    """

    def __init__(self, build: Build) -> None:
        self.build = build
        self.base = build.base
        self.rim = build.outline
        self.radius_m = max((_reach(shape) for shape in build.outline), default=0.1)
        # The robot is still at the origin of the world, so these poses are relative to the robot.
        self.poses = tuple(shape.pose for shape in build.outline)
        self.touched = 0
        self.velocity = (0.0, 0.0, 0.0)
        self._joints: Any = None  # views of MuJoCo's arrays; None before the first model
        self._speeds: Any = None
        self._controls: Any = None
        # Target speeds and their corrections, in the robot's axes; see `command` and `_lagged`.
        self._wanted: Sequence[float] = _REST
        self._changes: Sequence[float] = _REST
        self._aims: Sequence[float] = _REST
        self._lags: Sequence[float] = _REST
        self.x = self.y = self.heading_rad = self.s = 0.0
        self.c = 1.0

    def attach(self, joints: Any, speeds: Any, controls: Any) -> None:
        """Use these arrays of a new model for this body, and write the state of the body to them."""
        self._joints, self._speeds, self._controls = joints, speeds, controls
        self.write()

    def write(self) -> None:
        """Write the state of the body to MuJoCo's arrays."""
        self._joints[:] = self.x, self.y, self.heading_rad
        self._speeds[:] = self.velocity

    def bits(self, outline: Sequence[Shape]) -> int:
        """Return the bits that represent the parts with these shapes in `touched`."""
        parts = (*self.build.outline, *(shape for link in self.build.links for shape in link.shapes))
        return sum(1 << index for index, shape in enumerate(parts) if shape in outline)

    def place(self, x: float, y: float, heading_rad: float) -> None:
        """Set the position and heading of the robot; the robot keeps its velocity."""
        self._stand(x, y, heading_rad)
        if self._joints is not None:
            self._joints[:] = x, y, heading_rad

    def halt(self) -> None:
        """Stop all motion; the motors start from rest."""
        self.base.halt()
        self.touched = 0
        self._set_speed(0.0, 0.0, 0.0)

    def push(self, vx: float, vy: float, omega: float) -> None:
        """Give the body a velocity in world axes; its motors start from the matching speeds."""
        self.base.push(vx * self.c + vy * self.s, vy * self.c - vx * self.s, omega)
        self._set_speed(vx, vy, omega)

    def command(self, step_s: float, *, powered: bool) -> None:
        """Turn the wheels for one basic step, and set the target speeds of the servos.

        A servo needs a part of the step to reach a new speed, so the robot loses distance. The target speeds
        of the next step make up for this distance. So a robot stops where the wheel kinematics predict.
        """
        if powered:
            self.base.turn(step_s)
        wanted = (self.base.vx, self.base.vy, self.base.omega)
        self._changes = list(map(sub, wanted, self._wanted))
        self._wanted = wanted
        self._aims = list(map(add, wanted, self._lags))
        self._controls[:] = self._aims

    def follow(self, step_s: float) -> None:
        """Copy the pose that MuJoCo has computed."""
        x, y, turned = self._joints.tolist()
        heading = math.remainder(turned, 2.0 * math.pi)
        omega = math.remainder(heading - self.heading_rad, 2.0 * math.pi) / step_s
        self.velocity = ((x - self.x) / step_s, (y - self.y) / step_s, omega)
        self._lags = self._lagged(heading - 0.5 * omega * step_s)
        self._stand(x, y, heading)

    def _lagged(self, heading_rad: float) -> list[float]:
        """Return the mean difference between the target speeds and the actual speeds in this step.

        The differences are in the robot's axes at the middle of the step. Each difference is at most the
        change of the target speed in this step. So while an obstacle stops the robot and the target speed is
        constant, no difference accumulates, and the robot does not jump when it is free again.
        """
        c, s = math.cos(heading_rad), math.sin(heading_rad)
        vx, vy, omega = self.velocity
        driven = (vx * c + vy * s, vy * c - vx * s, omega)
        return [
            math.copysign(min(abs(aim - speed), abs(change)), aim - speed)
            for aim, speed, change in zip(self._aims, driven, self._changes, strict=True)
        ]

    def _forget(self) -> None:
        """Discard the target speeds of the last step; the servos start from rest."""
        self._wanted = self._changes = self._aims = self._lags = _REST

    def _set_speed(self, vx: float, vy: float, omega: float) -> None:
        self._forget()
        self.velocity = (vx, vy, omega)
        if self._speeds is not None:
            self._speeds[:] = self.velocity

    def _stand(self, x: float, y: float, heading_rad: float) -> None:
        self.x = x
        self.y = y
        self.heading_rad = heading_rad
        self.c = math.cos(heading_rad)
        self.s = math.sin(heading_rad)


_RESERVE: Final = 2.0  # multiplies the force for the largest acceleration, so that a servo can catch up
# The largest accelerations that the servos can give to a free robot, in m/s2, m/s2 and rad/s2.
LARGEST_ACCELERATIONS: Final = tuple(_RESERVE * largest for largest in ACCELERATIONS)
GAIN: Final = 500.0  # in 1/s: a servo reaches its target speed within one or two MuJoCo steps of 4 ms


def servo(axis: int, inertia: float) -> tuple[float, float]:
    """Return the gain and the maximum force of a servo; `inertia` is a mass in kg or an inertia in kg m2."""
    return GAIN * inertia, _RESERVE * ACCELERATIONS[axis] * inertia


def _reach(shape: Shape) -> float:
    """Return the distance from the robot's origin to the farthest point of a shape, seen from above."""
    x, y, _ = shape.pose.position
    return math.hypot(x, y) + (
        shape.size[0] / 2.0
        if shape.kind not in {"box", "mesh"}
        else math.hypot(shape.size[0], shape.size[1]) / 2.0
    )
