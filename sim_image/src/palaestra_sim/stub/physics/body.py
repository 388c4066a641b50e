"""A robot on the floor: from wheel motors to a pose, basic step by basic step.

The law of its wheels is in `drive`. In Webots torque and friction limit the acceleration of a robot. Here
three limits replace them: 10 m/s2 along x, 6 m/s2 along y, 20 rad/s2 about z. They are those of the Robotino
3's own controller (Webots, projects/robots/festo/robotino3/controllers/robotino3/base.c). All three axes are
slowed by the same factor, as in its `base_accelerate`. A motor's own `acceleration` is an additional limit.

A robot is one or several upright cylinders. An obstacle pushes it out along the normal, so that it slides
while its wheels turn. There is no mass, no bounce and no other friction. Everything is a function of the
commands.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from palaestra_sim.stub.physics.drive import Drive
from palaestra_sim.stub.physics.motors import Motor
from palaestra_sim.stub.physics.obstacles import Contact, Disc, Neighborhood, Obstacle, Ray
from palaestra_sim.stub.physics.outline import RoundPart

ACCELERATIONS: Final = (10.0, 6.0, 20.0)  # m/s2, m/s2, rad/s2

_PASSES: Final = 4  # a corner has two walls and perhaps a robot; more passes change nothing
_RESTING_M: Final = 1e-9  # a robot that was pushed out rests at the surface, give or take rounding
_STRIDE: Final = 0.3  # of the smallest radius: how far a robot may move before it looks for contacts


class Body(Disc):
    """A robot of upright cylinders: a pose, a velocity, and wheels where it has any.

    Its own disc is the one around all of them.

    Args:
        outline: the cylinders; none: nothing can run into it.
        wheels: the motors of the wheels.
        drive: the law of these wheels; None: they do not move it.

    Attributes:
        heading_rad: in (-pi, pi].
        c, s: cosine and sine of the heading.
        velocity: vx, vy in m/s and omega in rad/s, in world axes, over the last basic step.
        touched: the parts that were touched since the bumpers were last read, a bit each (part 0 is 1); their
            reader clears it.
    """

    __slots__ = (
        "_arm_m",
        "_drive_law",
        "_omega",
        "_others",
        "_parts",
        "_solids",
        "_step_s",
        "_stride_m",
        "_vx",
        "_vy",
        "_wheels",
        "c",
        "heading_rad",
        "s",
        "touched",
        "velocity",
    )

    def __init__(
        self, outline: Sequence[RoundPart], wheels: Sequence[Motor] = (), drive: Drive | None = None
    ) -> None:
        super().__init__(0.0, 0.0, max((math.hypot(x, y) + radius for x, y, radius in outline), default=0.0))
        if drive is not None and len(wheels) != len(drive.to_speeds):
            raise ValueError(f"{len(wheels)} motors do not fit a drive of {len(drive.to_speeds)} wheels")
        self._parts = tuple(outline)
        self._stride_m = _STRIDE * min((radius for _, _, radius in outline), default=0.0)
        # Of the farthest axis; a turn moves nothing of a cylinder that stands in the middle.
        self._arm_m = max((math.hypot(x, y) for x, y, _ in outline), default=0.0)
        self._wheels = tuple(wheels) if drive is not None else ()
        self._drive_law = drive
        self._solids = Neighborhood((), 0.0)
        self._others: tuple[Body, ...] = ()
        self._step_s = 0.0
        self.place(0.0, 0.0, 0.0)
        self.halt()

    @property
    def frame(self) -> tuple[float, float, float, float]:
        """X, y, cosine and sine of the heading."""
        return self.x, self.y, self.c, self.s

    @property
    def discs(self) -> list[Disc]:
        """The cylinders where they are now, seen from above."""
        return [
            Disc(self.x + along * self.c - aside * self.s, self.y + along * self.s + aside * self.c, radius)
            for along, aside, radius in self._parts
        ]

    @property
    def drive(self) -> Drive | None:
        """The law of its wheels; None if nothing drives it."""
        return self._drive_law

    def driven_by(self, motor: Motor) -> bool:
        """Return whether a motor turns one of the wheels."""
        return motor in self._wheels

    def face(self, solids: Neighborhood, others: Sequence[Body]) -> None:
        """Set the obstacles of the body."""
        self._solids = solids
        self._others = tuple(others)

    def contact(self, x: float, y: float, radius: float) -> Contact | None:
        """Return how a round robot at x, y is to be pushed out, None if it does not touch."""
        deepest: Contact | None = None
        for disc in self.discs:
            contact = disc.contact(x, y, radius)
            if contact is not None and (deepest is None or contact[2] > deepest[2]):
                deepest = contact
        return deepest

    def scan(self, frame: tuple[float, float, float, float], rays: Sequence[Ray], reach: list[float]) -> None:
        """Shorten `reach` to where the rays of a robot at `frame` meet a part of this one."""
        for disc in self.discs:
            disc.scan(frame, rays, reach)

    def place(self, x: float, y: float, heading_rad: float) -> None:
        """Place the robot somewhere; its motion continues."""
        self.x = x
        self.y = y
        self.heading_rad = heading_rad
        self.c = math.cos(heading_rad)
        self.s = math.sin(heading_rad)

    def crossing(self, frame: tuple[float, float, float, float], ray: Ray) -> tuple[float, float]:
        """Return where a ray enters the first part and leaves the last; enter > leave: it misses."""
        crossings = [disc.crossing(frame, ray) for disc in self.discs]
        met = [crossing for crossing in crossings if crossing[1] >= 0.0 and crossing[0] <= crossing[1]]
        return min(met, default=(math.inf, -math.inf))

    def halt(self) -> None:
        """Stop all motion; the motors begin again from rest."""
        self._vx = self._vy = self._omega = 0.0
        self.velocity = (0.0, 0.0, 0.0)
        self.touched = 0
        for wheel in self._wheels:
            wheel.speed_rad_s = 0.0
            wheel.changed = True

    def push(self, vx: float, vy: float, omega: float) -> None:
        """Give the body a velocity in world axes; its motors start from there."""
        self._vx = vx * self.c + vy * self.s
        self._vy = vy * self.c - vx * self.s
        self._omega = omega
        self.velocity = (vx, vy, omega)
        if self._drive_law is not None:
            speeds = self._drive_law.wheel_speeds(self._vx, self._vy, omega)
            for wheel, speed in zip(self._wheels, speeds, strict=True):
                wheel.speed_rad_s = speed
                wheel.changed = True

    def advance(self, step_s: float) -> None:
        """Move on by one basic step."""
        if self._drive_law is not None:
            changed = step_s != self._step_s
            for wheel in self._wheels:
                changed = changed or wheel.changed
            if changed:
                self._drive(step_s, self._drive_law)
            for wheel in self._wheels:
                wheel.angle_rad += wheel.speed_rad_s * step_s
            if self._vx or self._vy or self._omega:
                self._move(step_s)
                return
        self.velocity = (0.0, 0.0, 0.0)
        self._push_out()

    def _drive(self, step_s: float, law: Drive) -> None:
        """Change the speeds of the wheels toward those that their motors demand."""
        wheels = self._wheels
        demands = [wheel.demand(step_s) for wheel in wheels]
        changes = [demand - wheel.speed_rad_s for demand, wheel in zip(demands, wheels, strict=True)]
        twist = law.twist(changes)
        steps = max(abs(part) / (limit * step_s) for part, limit in zip(twist, ACCELERATIONS, strict=True))
        for wheel, demand, change in zip(wheels, demands, changes, strict=True):
            wheel.speed_rad_s = demand if steps <= 1.0 else wheel.speed_rad_s + change / steps
            wheel.changed = not wheel.steady
        self._vx, self._vy, self._omega = law.twist([wheel.speed_rad_s for wheel in wheels])
        self._step_s = step_s

    def _move(self, step_s: float) -> None:
        """Drive along an arc, in strides short enough that nothing is passed through."""
        c = self.c
        s = self.s
        turned = self._omega * step_s
        if turned:
            middle = self.heading_rad + 0.5 * turned
            c = math.cos(middle)
            s = math.sin(middle)
            if not self._arm_m:
                self._turn(turned)
        dx = (self._vx * c - self._vy * s) * step_s
        dy = (self._vx * s + self._vy * c) * step_s
        x = self.x
        y = self.y
        way = abs(dx) + abs(dy) + abs(turned) * self._arm_m
        strides = 1 + int(way / self._stride_m) if self._stride_m else 1
        for _ in range(strides):
            if turned and self._arm_m:
                self._turn(turned / strides)
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
                clear = self._leave(solid) and clear
            for other in self._others:
                clear = self._leave(other) and clear
            if clear:
                return

    def _leave(self, obstacle: Obstacle) -> bool:
        """Push the robot out of one obstacle; return whether it was clear of it."""
        clear = True
        bit = 1
        for along, aside, radius in self._parts:
            x = self.x + along * self.c - aside * self.s
            y = self.y + along * self.s + aside * self.c
            contact = obstacle.contact(x, y, radius)
            if contact is not None:
                clear = False
                self.x += contact[0] * contact[2]
                self.y += contact[1] * contact[2]
                if contact[2] > _RESTING_M:
                    self.touched |= bit
                    if isinstance(obstacle, Body):
                        obstacle.feel(x, y, radius)
            bit <<= 1
        return clear

    def feel(self, x: float, y: float, radius: float) -> None:
        """Note which parts a round robot at x, y touches."""
        for index, disc in enumerate(self.discs):
            contact = disc.contact(x, y, radius)
            if contact is not None and contact[2] > _RESTING_M:
                self.touched |= 1 << index
