"""The Robotino on the floor: from three wheel motors to a pose, basic step by basic step.

Kinematics and geometry are the Robotino 3's. Wheel 0 is at the rear, 1 front right, and 2 front left.
    w0 = (vy - L omega) / R,  w1 = (-k vx - vy / 2 - L omega) / R,  w2 = (k vx - vy / 2 - L omega) / R,

with k = sqrt(3/4). Source: Webots, projects/robots/festo/robotino3/controllers/robotino3/base.c.

Acceleration: the motors' `acceleration` is -1 in the Robotino 3, so in Webots only torque and friction
limit the wheels. Here the limits of base.c replace them: 10 m/s2, 6 m/s2 and 20 rad/s2 along x, y and about
z. All three axes are slowed by the same factor, as in its `base_accelerate`. (10 N m at two of three wheels
and 23 kg would give 12 m/s2.) A motor's own `acceleration` is an additional limit.

A robot is a cylinder. An obstacle pushes it out along the normal, so that it slides while its wheels turn.
There is no mass, no bounce and no other friction. Everything is a function of the commands.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from palaestra_sim.stub.physics.motors import Motor
from palaestra_sim.stub.physics.obstacles import Disc, Neighborhood

WHEEL_RADIUS_M: Final = 0.063
WHEEL_DISTANCE_M: Final = 0.1826
ACCELERATIONS: Final = (10.0, 6.0, 20.0)  # m/s2, m/s2, rad/s2
WHEELS: Final = ("wheel0_joint", "wheel1_joint", "wheel2_joint")

_K: Final = math.sqrt(0.75)
_PASSES: Final = 4  # a corner has two walls and perhaps a robot; more passes change nothing
_RESTING_M: Final = 1e-9  # a robot that was pushed out rests at the surface, give or take rounding
_STRIDE: Final = 0.3  # of the radius: how far a robot may move before it looks for contacts


def twist(w0: float, w1: float, w2: float) -> tuple[float, float, float]:
    """Return vx, vy in m/s and omega in rad/s from the wheels' speeds in rad/s."""
    return (
        WHEEL_RADIUS_M * (w2 - w1) / (2.0 * _K),
        WHEEL_RADIUS_M * (2.0 * w0 - w1 - w2) / 3.0,
        -WHEEL_RADIUS_M * (w0 + w1 + w2) / (3.0 * WHEEL_DISTANCE_M),
    )


def wheel_speeds(vx: float, vy: float, omega: float) -> tuple[float, float, float]:
    """Return the wheels' speeds in rad/s for a twist in m/s, m/s, rad/s."""
    turning = WHEEL_DISTANCE_M * omega
    return (
        (vy - turning) / WHEEL_RADIUS_M,
        (-_K * vx - 0.5 * vy - turning) / WHEEL_RADIUS_M,
        (_K * vx - 0.5 * vy - turning) / WHEEL_RADIUS_M,
    )


class Body(Disc):
    """A round robot: a pose, a velocity, and wheels where it has any.

    Attributes:
        heading_rad: in (-pi, pi].
        c, s: cosine and sine of the heading.
        velocity: vx, vy in m/s and omega in rad/s, in world axes, over the last basic step.
        touched: whether anything was touched since the bumper was last read; its reader clears it.
    """

    __slots__ = (
        "_omega",
        "_others",
        "_solids",
        "_step_s",
        "_vx",
        "_vy",
        "_wheels",
        "c",
        "heading_rad",
        "s",
        "touched",
        "velocity",
    )

    def __init__(self, radius_m: float, wheels: Sequence[Motor]) -> None:
        super().__init__(0.0, 0.0, radius_m)
        self._wheels = tuple(wheels)
        self._solids = Neighborhood((), 0.0)
        self._others: tuple[Body, ...] = ()
        self._step_s = 0.0
        self.place(0.0, 0.0, 0.0)
        self.halt()

    @property
    def frame(self) -> tuple[float, float, float, float]:
        """X, y, cosine and sine of the heading."""
        return self.x, self.y, self.c, self.s

    def driven_by(self, motor: Motor) -> bool:
        """Return whether a motor turns one of the wheels."""
        return motor in self._wheels

    def face(self, solids: Neighborhood, others: Sequence[Body]) -> None:
        """Set the obstacles of the body."""
        self._solids = solids
        self._others = tuple(others)

    def place(self, x: float, y: float, heading_rad: float) -> None:
        """Place the robot somewhere; its motion continues."""
        self.x = x
        self.y = y
        self.heading_rad = heading_rad
        self.c = math.cos(heading_rad)
        self.s = math.sin(heading_rad)

    def halt(self) -> None:
        """Stop all motion; the motors begin again from rest."""
        self._vx = self._vy = self._omega = 0.0
        self.velocity = (0.0, 0.0, 0.0)
        self.touched = False
        for wheel in self._wheels:
            wheel.speed_rad_s = 0.0
            wheel.changed = True

    def push(self, vx: float, vy: float, omega: float) -> None:
        """Give the body a velocity in world axes; its motors start from there."""
        self._vx = vx * self.c + vy * self.s
        self._vy = vy * self.c - vx * self.s
        self._omega = omega
        self.velocity = (vx, vy, omega)
        speeds = wheel_speeds(self._vx, self._vy, omega)
        for wheel, speed in zip(self._wheels, speeds, strict=False):
            wheel.speed_rad_s = speed
            wheel.changed = True

    def advance(self, step_s: float) -> None:
        """Move on by one basic step."""
        if self._wheels:
            w0, w1, w2 = self._wheels
            if w0.changed or w1.changed or w2.changed or step_s != self._step_s:
                self._drive(step_s)
            w0.angle_rad += w0.speed_rad_s * step_s
            w1.angle_rad += w1.speed_rad_s * step_s
            w2.angle_rad += w2.speed_rad_s * step_s
            if self._vx or self._vy or self._omega:
                self._move(step_s)
                return
        self.velocity = (0.0, 0.0, 0.0)
        self._push_out()

    def _drive(self, step_s: float) -> None:
        """Change the speeds of the wheels toward those that their motors demand."""
        w0, w1, w2 = self._wheels
        d0 = w0.demand(step_s) - w0.speed_rad_s
        d1 = w1.demand(step_s) - w1.speed_rad_s
        d2 = w2.demand(step_s) - w2.speed_rad_s
        vx, vy, omega = twist(d0, d1, d2)
        steps = max(
            abs(vx) / (ACCELERATIONS[0] * step_s),
            abs(vy) / (ACCELERATIONS[1] * step_s),
            abs(omega) / (ACCELERATIONS[2] * step_s),
        )
        if steps > 1.0:
            d0, d1, d2 = d0 / steps, d1 / steps, d2 / steps
            w0.speed_rad_s += d0
            w1.speed_rad_s += d1
            w2.speed_rad_s += d2
        else:
            w0.speed_rad_s, w1.speed_rad_s, w2.speed_rad_s = (w.demand(step_s) for w in self._wheels)
        for wheel in self._wheels:
            wheel.changed = not wheel.steady
        self._vx, self._vy, self._omega = twist(w0.speed_rad_s, w1.speed_rad_s, w2.speed_rad_s)
        self._step_s = step_s

    def _move(self, step_s: float) -> None:
        """Drive along an arc, in strides short enough that nothing is passed through."""
        c = self.c
        s = self.s
        if self._omega:
            turned = self._omega * step_s
            middle = self.heading_rad + 0.5 * turned
            c = math.cos(middle)
            s = math.sin(middle)
            self._turn(turned)
        dx = (self._vx * c - self._vy * s) * step_s
        dy = (self._vx * s + self._vy * c) * step_s
        x = self.x
        y = self.y
        strides = 1 + int((abs(dx) + abs(dy)) / (_STRIDE * self.radius)) if self.radius else 1
        for _ in range(strides):
            self.x += dx / strides
            self.y += dy / strides
            if self._others or self._solids.near(self.x, self.y):
                self._push_out()
        self.velocity = ((self.x - x) / step_s, (self.y - y) / step_s, self._omega)

    def _turn(self, turned_rad: float) -> None:
        heading = self.heading_rad + turned_rad
        if not -math.pi < heading <= math.pi:
            heading = math.remainder(heading, 2.0 * math.pi)
        self.heading_rad = heading
        self.c = math.cos(heading)
        self.s = math.sin(heading)

    def _push_out(self) -> None:
        """Push the robot out of obstacles along the normals; the remaining motion is sliding."""
        for _ in range(_PASSES):
            clear = True
            for solid in self._solids.near(self.x, self.y):
                contact = solid.contact(self.x, self.y, self.radius)
                if contact is not None:
                    self._leave(contact)
                    clear = False
            for other in self._others:
                contact = other.contact(self.x, self.y, self.radius)
                if contact is not None:
                    self._leave(contact)
                    other.touched = other.touched or contact[2] > _RESTING_M
                    clear = False
            if clear:
                return

    def _leave(self, contact: tuple[float, float, float]) -> None:
        self.x += contact[0] * contact[2]
        self.y += contact[1] * contact[2]
        if contact[2] > _RESTING_M:
            self.touched = True
