"""The floor and the obstacles on it, from which a task chooses free positions.

A layout does not change: each call of `Scene.layout` reads a new layout from the world. So a task chooses
positions around the current positions of the objects, even if an episode or a person has moved the objects.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from palaestra_trainer.robots.geometry import Point

REACH_M = 0.5  # robots are lower than this height, and pass below an object that hangs higher
SUNKEN_M = 0.001  # an object that rises less above the floor counts as part of the floor


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacle:
    """An upright object whose outline on the floor is a rectangle with rounded corners, or a circle.

    Attributes:
        name: DEF name of the object in the world; "" without a DEF name.
        x_m: x of the object's center.
        y_m: y of the object's center.
        bottom_m: height of the object's lower side.
        top_m: height of the object's upper side.
        half_m: half the length along the object's own axes x and y, without the rounding; zeros for a circle.
        radius_m: radius of the rounding, or of the circle.
        heading_rad: direction of the object's own x axis in the world.
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
        """Whether a robot can touch the object; False for an object under the floor or above all robots."""
        return self.top_m > SUNKEN_M and self.bottom_m < REACH_M

    def moved(self, x_m: float, y_m: float, z_m: float) -> Obstacle:
        """Return a copy of the object with its center at another position."""
        half = 0.5 * (self.top_m - self.bottom_m)
        return replace(self, x_m=x_m, y_m=y_m, bottom_m=z_m - half, top_m=z_m + half)

    def gap(self, x_m: float, y_m: float) -> float:
        """Return the distance from a point of the floor to the outline in meters; negative inside."""
        c, s = math.cos(self.heading_rad), math.sin(self.heading_rad)
        dx, dy = x_m - self.x_m, y_m - self.y_m
        beyond_x = abs(dx * c + dy * s) - self.half_m[0]
        beyond_y = abs(dy * c - dx * s) - self.half_m[1]
        outside = math.hypot(max(beyond_x, 0.0), max(beyond_y, 0.0))
        return outside + min(max(beyond_x, beyond_y), 0.0) - self.radius_m

    def away(self, x_m: float, y_m: float) -> Point:
        """Return the direction from a point away from the object; inside the object, the shortest way out."""
        small = 1e-4
        gx = self.gap(x_m + small, y_m) - self.gap(x_m - small, y_m)
        gy = self.gap(x_m, y_m + small) - self.gap(x_m, y_m - small)
        length = math.hypot(gx, gy) or 1.0
        return gx / length, gy / length


@dataclass(frozen=True, slots=True, kw_only=True)
class FloorLayout:
    """A floor and the objects on it.

    Attributes:
        low: smallest x and y of the floor in meters; its sides are parallel to x and y.
        high: greatest x and y of the floor in meters.
        obstacles: all objects except the floor, robots and marks; objects under the floor are included.
    """

    low: Point
    high: Point
    obstacles: tuple[Obstacle, ...] = ()

    def gap(self, x_m: float, y_m: float) -> float:
        """Return meters to the nearest obstacle or floor edge; negative in an obstacle or off the floor."""
        edge = min(x_m - self.low[0], self.high[0] - x_m, y_m - self.low[1], self.high[1] - y_m)
        return min(edge, *(thing.gap(x_m, y_m) for thing in self.obstacles if thing.standing), math.inf)
