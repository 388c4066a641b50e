"""What stands on a floor, as a task needs it to draw free places.

A layout is a value: the scene makes it anew from the world whenever it is asked. So a task is drawn
around the things where they are, also if an episode or a person has moved them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from palaestra_trainer.robots.geometry import Point

REACH_M = 0.5  # robots are lower, and pass below a thing that hangs higher
SUNKEN_M = 0.001  # what rises less above the floor is a part of it


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacle:
    """An upright thing: a rectangle with rounded corners on the floor, or a circle.

    Attributes:
        name: its DEF name in the world; "" without one.
        x_m: of its center, as `y_m`.
        y_m: see above.
        bottom_m: height of its lower side.
        top_m: height of its upper side.
        half_m: half its length along its own axes x and y, without the rounding; zeros for a circle.
        radius_m: of the rounding, or of the circle.
        heading_rad: of its x axis in the world.
    """

    name: str
    x_m: float
    y_m: float
    bottom_m: float
    top_m: float
    half_m: Point = (0.0, 0.0)
    radius_m: float = 0.0
    heading_rad: float = 0.0

    @property
    def standing(self) -> bool:
        """Whether a robot can touch it: not if it is stored under the floor or hangs above robots."""
        return self.top_m > SUNKEN_M and self.bottom_m < REACH_M

    def moved(self, x_m: float, y_m: float, z_m: float) -> Obstacle:
        """Return it with its center at another place."""
        half = 0.5 * (self.top_m - self.bottom_m)
        return replace(self, x_m=x_m, y_m=y_m, bottom_m=z_m - half, top_m=z_m + half)

    def gap(self, x_m: float, y_m: float) -> float:
        """Return meters from a point of the floor to its outline; negative inside."""
        c, s = math.cos(self.heading_rad), math.sin(self.heading_rad)
        dx, dy = x_m - self.x_m, y_m - self.y_m
        beyond_x = abs(dx * c + dy * s) - self.half_m[0]
        beyond_y = abs(dy * c - dx * s) - self.half_m[1]
        outside = math.hypot(max(beyond_x, 0.0), max(beyond_y, 0.0))
        return outside + min(max(beyond_x, beyond_y), 0.0) - self.radius_m

    def away(self, x_m: float, y_m: float) -> Point:
        """Return the direction that leads out of it, or away from it, the shortest way from a point."""
        small = 1e-4
        gx = self.gap(x_m + small, y_m) - self.gap(x_m - small, y_m)
        gy = self.gap(x_m, y_m + small) - self.gap(x_m, y_m - small)
        length = math.hypot(gx, gy) or 1.0
        return gx / length, gy / length


@dataclass(frozen=True, slots=True, kw_only=True)
class FloorLayout:
    """A floor and the things on it.

    Attributes:
        low: x, y in meters of one corner of the floor, whose sides lie along x and y.
        high: of the opposite corner, with the greater numbers.
        obstacles: everything that is not the floor, a robot or a mark; also what is stored under the floor.
    """

    low: Point
    high: Point
    obstacles: tuple[Obstacle, ...] = ()

    def gap(self, x_m: float, y_m: float) -> float:
        """Return meters from a point to the nearest thing or edge of the floor; negative inside or beyond."""
        edge = min(x_m - self.low[0], self.high[0] - x_m, y_m - self.low[1], self.high[1] - y_m)
        return min(edge, *(thing.gap(x_m, y_m) for thing in self.obstacles if thing.standing), math.inf)
