"""A robot on the floor: from the speed of its base to a pose, basic step by basic step.

A robot is one or several upright cylinders. An obstacle pushes it out along the normal, so that it slides
while its wheels turn. There is no mass, no bounce and no friction. The motion depends only on the commands.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from palaestra_sim.scene.mobile_base import MobileBase
from palaestra_sim.scene.sensor_rays import Ray
from palaestra_sim.scene.shapes import Shape
from palaestra_sim.stub.obstacles import Contact, Disc, FlatObstacle, Neighborhood
from palaestra_sim.stub.outline import RoundPart

_PASSES: Final = 4  # a corner has two walls and perhaps a robot; more passes change nothing
_RESTING_M: Final = 1e-9  # a robot that was pushed out rests at the surface, up to rounding
_STRIDE: Final = 0.3  # maximum motion between two checks for contacts, in smallest radii


class StubBody(Disc):
    """A robot of upright cylinders: see `Body`.

    As a `Disc` it is the disc around all of them.

    Args:
        base: its wheels.
        outline: the cylinders; without any, nothing can touch it.
        rim: for each cylinder, the shape to which it belongs.
        heights: z of their lower and upper ends, in the robot's frame.

    Attributes:
        base, rim, heights: the arguments.
        heading_rad: in (-pi, pi].
        c, s: cosine and sine of the heading.
        velocity: vx, vy in m/s and omega in rad/s, in world axes, over the last basic step.
        touched: the cylinders that were touched since the bumpers were last read, one bit each (the first is
            1); the bumpers' reader clears it.
    """

    __slots__ = (
        "_arm_m",
        "_others",
        "_parts",
        "_solids",
        "_stride_m",
        "base",
        "c",
        "heading_rad",
        "heights",
        "rim",
        "s",
        "touched",
        "velocity",
    )

    def __init__(
        self,
        base: MobileBase,
        outline: Sequence[RoundPart] = (),
        rim: Sequence[Shape] = (),
        heights: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        super().__init__(0.0, 0.0, max((math.hypot(x, y) + radius for x, y, radius in outline), default=0.0))
        self.base = base
        self.rim = tuple(rim)
        self.heights = heights
        self._parts = tuple(outline)
        self._stride_m = _STRIDE * min((radius for _, _, radius in outline), default=0.0)
        # The distance of the farthest axis from the middle; a turn does not move a cylinder whose axis is
        # in the middle.
        self._arm_m = max((math.hypot(x, y) for x, y, _ in outline), default=0.0)
        self._solids = Neighborhood((), 0.0)
        self._others: tuple[StubBody, ...] = ()
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

    def bits(self, outline: Sequence[Shape]) -> int:
        """Return the cylinders that belong to these shapes, as bits of `touched`."""
        return sum(1 << index for index, shape in enumerate(self.rim) if shape in outline)

    def face(self, solids: Neighborhood, others: Sequence[StubBody]) -> None:
        """Set the obstacles of the body."""
        self._solids = solids
        self._others = tuple(others)

    def contact(self, x: float, y: float, radius: float) -> Contact | None:
        """Return the push that moves a round robot at x, y out of this one; None if they do not touch."""
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
        """Set the position and heading of the robot; its motion continues."""
        self.x = x
        self.y = y
        self.heading_rad = heading_rad
        self.c = math.cos(heading_rad)
        self.s = math.sin(heading_rad)

    def crossing(self, frame: tuple[float, float, float, float], ray: Ray) -> tuple[float, float]:
        """Return the meters to where a ray enters and leaves the first part; enter > leave if it misses."""
        crossings = [disc.crossing(frame, ray) for disc in self.discs]
        met = [crossing for crossing in crossings if crossing[1] >= 0.0 and crossing[0] <= crossing[1]]
        return min(met, default=(math.inf, -math.inf))

    def halt(self) -> None:
        """Stop all motion; the motors start from rest."""
        self.base.halt()
        self.velocity = (0.0, 0.0, 0.0)
        self.touched = 0

    def push(self, vx: float, vy: float, omega: float) -> None:
        """Give the body a velocity in world axes; its motors continue from there."""
        self.base.push(vx * self.c + vy * self.s, vy * self.c - vx * self.s, omega)
        self.velocity = (vx, vy, omega)

    def advance(self, step_s: float) -> None:
        """Move the robot by one basic step."""
        if self.base.turn(step_s):
            self._move(step_s)
        else:
            self.velocity = (0.0, 0.0, 0.0)
            self._push_out()

    def _move(self, step_s: float) -> None:
        """Drive along an arc, in strides short enough that the robot passes through nothing."""
        base = self.base
        c = self.c
        s = self.s
        turned = base.omega * step_s
        if turned:
            middle = self.heading_rad + 0.5 * turned
            c = math.cos(middle)
            s = math.sin(middle)
            if not self._arm_m:
                self._turn(turned)
        dx = (base.vx * c - base.vy * s) * step_s
        dy = (base.vx * s + base.vy * c) * step_s
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
        self.velocity = ((self.x - x) / step_s, (self.y - y) / step_s, base.omega)

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

    def _leave(self, obstacle: FlatObstacle) -> bool:
        """Push the robot out of one obstacle; return whether it did not touch it."""
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
                    if isinstance(obstacle, StubBody):
                        obstacle.feel(x, y, radius)
            bit <<= 1
        return clear

    def feel(self, x: float, y: float, radius: float) -> None:
        """Record which parts a round robot at x, y touches."""
        for index, disc in enumerate(self.discs):
            contact = disc.contact(x, y, radius)
            if contact is not None and contact[2] > _RESTING_M:
                self.touched |= 1 << index
