"""The motion of a robot on the floor: in each basic step, the speed of its base changes its pose.

A robot consists of one or several upright cylinders. If a cylinder is inside an obstacle, the robot is pushed
out along the surface normal; while its wheels turn, it slides along the surface. There is no mass, no bounce
and no friction, so the motion depends only on the commands.
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

_PASSES: Final = 4  # maximum number of passes; enough for a corner of two walls and another robot
_RESTING_M: Final = 1e-9  # because of rounding, a robot that rests at a surface may be this deep in it
_STRIDE: Final = 0.3  # maximum motion between two checks for contacts, as a share of the smallest radius


class StubBody(Disc):
    """The body of a robot that consists of upright cylinders; see `Body`.

    The base class `Disc` is the circle around all cylinders.

    Args:
        base: the wheels of the robot.
        outline: the cylinders; if there are none, the robot has no contacts.
        rim: for each cylinder, the shape to which it belongs.
        heights: z of the lower and the upper end of all cylinders, in the robot's frame.

    Attributes:
        base, rim, heights: the arguments.
        heading_rad: the heading, in (-pi, pi].
        c, s: cosine and sine of the heading.
        velocity: vx, vy in m/s and omega in rad/s, in world axes, over the last basic step.
        touched: one bit for each cylinder that touched an obstacle since the bumpers were last read; the
            first cylinder has bit 1. The code that reads the bumpers clears the bits.
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
        # The distance from the robot's origin to the farthest cylinder axis. It is 0 if all axes are at the
        # origin; a turn then moves no cylinder.
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
        """The cylinders at their current positions, as seen from above."""
        return [
            Disc(self.x + along * self.c - aside * self.s, self.y + along * self.s + aside * self.c, radius)
            for along, aside, radius in self._parts
        ]

    def bits(self, outline: Sequence[Shape]) -> int:
        """Return the bits in `touched` of the cylinders that belong to these shapes."""
        return sum(1 << index for index, shape in enumerate(self.rim) if shape in outline)

    def face(self, solids: Neighborhood, others: Sequence[StubBody]) -> None:
        """Set the obstacles of the body: solids, and the bodies of other robots."""
        self._solids = solids
        self._others = tuple(others)

    def contact(self, x: float, y: float, radius: float) -> Contact | None:
        """Return the contact of a round robot at x, y with this robot; None if they do not touch."""
        deepest: Contact | None = None
        for disc in self.discs:
            contact = disc.contact(x, y, radius)
            if contact is not None and (deepest is None or contact[2] > deepest[2]):
                deepest = contact
        return deepest

    def scan(self, frame: tuple[float, float, float, float], rays: Sequence[Ray], reach: list[float]) -> None:
        """Shorten each `reach` to the distance at which its ray meets this robot; the rays are in `frame`."""
        for disc in self.discs:
            disc.scan(frame, rays, reach)

    def place(self, x: float, y: float, heading_rad: float) -> None:
        """Set the position and heading of the robot; the robot keeps its velocity."""
        self.x = x
        self.y = y
        self.heading_rad = heading_rad
        self.c = math.cos(heading_rad)
        self.s = math.sin(heading_rad)

    def crossing(self, frame: tuple[float, float, float, float], ray: Ray) -> tuple[float, float]:
        """Return the distances in meters at which a ray enters and leaves the first cylinder that it meets.

        If the ray meets no cylinder, the first number is greater than the second.
        """
        crossings = [disc.crossing(frame, ray) for disc in self.discs]
        met = [crossing for crossing in crossings if crossing[1] >= 0.0 and crossing[0] <= crossing[1]]
        return min(met, default=(math.inf, -math.inf))

    def halt(self) -> None:
        """Stop all motion; the motors start from rest."""
        self.base.halt()
        self.velocity = (0.0, 0.0, 0.0)
        self.touched = 0

    def push(self, vx: float, vy: float, omega: float) -> None:
        """Give the body a velocity in world axes; its motors start from the matching speeds."""
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
        """Drive along an arc, in strides so short that the robot cannot pass through an obstacle."""
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
        """Push the robot out of obstacles along their normals, so that it slides along their surfaces."""
        for _ in range(_PASSES):
            clear = True
            for solid in self._solids.near(self.x, self.y):
                clear = self._leave(solid) and clear
            for other in self._others:
                clear = self._leave(other) and clear
            if clear:
                return

    def _leave(self, obstacle: FlatObstacle) -> bool:
        """Push the robot out of one obstacle; return True if the robot did not touch the obstacle."""
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
        """Record which cylinders of this robot a round robot at x, y touches."""
        for index, disc in enumerate(self.discs):
            contact = disc.contact(x, y, radius)
            if contact is not None and contact[2] > _RESTING_M:
                self.touched |= 1 << index
