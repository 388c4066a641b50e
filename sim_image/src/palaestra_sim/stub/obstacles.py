"""The obstacles of robots and rays, as seen from above: discs, blocks, and the convex hulls of meshes.

Each shape computes the depth of a round robot in the shape, and the distance that a ray travels until it
meets the shape. This module ignores heights; callers pass only shapes at the height of the robot or ray.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Protocol

from palaestra_sim.scene.sensor_rays import Ray

# A contact of a robot with a shape: x and y of the unit normal, which points to the robot, and the depth in
# meters. A robot that moves by the depth along the normal no longer touches the shape.
Contact = tuple[float, float, float]
Point = tuple[float, float]  # x and y in meters

_SAME_PLACE_M2 = 1e-24  # squared distance below which rounding destroys the direction


class FlatObstacle(Protocol):
    """A shape on the floor."""

    def gap(self, x: float, y: float) -> float:
        """Return the distance in meters from a point to the shape; 0 or less for a point inside the shape."""
        ...

    def contact(self, x: float, y: float, radius: float) -> Contact | None:
        """Return the contact of a round robot at x, y with the shape; None if they do not touch."""
        ...

    def scan(self, frame: tuple[float, float, float, float], rays: Sequence[Ray], reach: list[float]) -> None:
        """Shorten each `reach` to the distance at which its ray meets the shape.

        Args:
            frame: x, y, cos and sin of the robot's heading.
            rays: the rays, in the robot's frame.
            reach: a distance in meters for each ray; changed in place.
        """
        ...

    def crossing(self, frame: tuple[float, float, float, float], ray: Ray) -> tuple[float, float]:
        """Return the distances in meters at which a ray enters and leaves the shape.

        If the ray misses the shape, the first number is greater than the second.
        """
        ...


class Disc:
    """A vertical cylinder, or another robot."""

    __slots__ = ("radius", "x", "y")

    def __init__(self, x: float, y: float, radius: float) -> None:
        self.x = x
        self.y = y
        self.radius = radius

    def gap(self, x: float, y: float) -> float:
        """Return the distance in meters from a point to the disc; negative for a point inside the disc."""
        return math.hypot(x - self.x, y - self.y) - self.radius

    def contact(self, x: float, y: float, radius: float) -> Contact | None:
        """Return the contact of a round robot at x, y with the disc; None if they do not touch."""
        dx = x - self.x
        dy = y - self.y
        reach = radius + self.radius
        squared = dx * dx + dy * dy
        if squared >= reach * reach:
            return None
        if squared < _SAME_PLACE_M2:
            return (1.0, 0.0, reach)
        distance = math.sqrt(squared)
        return (dx / distance, dy / distance, reach - distance)

    def scan(self, frame: tuple[float, float, float, float], rays: Sequence[Ray], reach: list[float]) -> None:
        """Shorten each `reach` to the distance at which its ray meets the disc; the rays are in `frame`."""
        x, y, c, s = frame
        dx = self.x - x
        dy = self.y - y
        mx = dx * c + dy * s
        my = dy * c - dx * s
        squared = self.radius * self.radius
        for i, (px, py, ux, uy) in enumerate(rays):
            ex = mx - px
            ey = my - py
            along = ex * ux + ey * uy
            aside = ex * uy - ey * ux
            half = squared - aside * aside
            if along > 0.0 and half > 0.0:
                reach[i] = min(reach[i], max(0.0, along - math.sqrt(half)))

    def crossing(self, frame: tuple[float, float, float, float], ray: Ray) -> tuple[float, float]:
        """Return the distances in meters at which a ray enters and leaves the disc; see `FlatObstacle`."""
        x, y, c, s = frame
        dx = self.x - x
        dy = self.y - y
        ex = dx * c + dy * s - ray[0]
        ey = dy * c - dx * s - ray[1]
        along = ex * ray[2] + ey * ray[3]
        aside = ex * ray[3] - ey * ray[2]
        half = self.radius * self.radius - aside * aside
        if half <= 0.0:
            return math.inf, -math.inf
        return along - math.sqrt(half), along + math.sqrt(half)


class Block:
    """A box with any heading: a wall, a crate."""

    __slots__ = ("c", "half_x", "half_y", "heading_rad", "s", "x", "y")

    def __init__(self, x: float, y: float, heading_rad: float, size: tuple[float, float]) -> None:
        self.x = x
        self.y = y
        self.heading_rad = heading_rad
        self.c = math.cos(heading_rad)
        self.s = math.sin(heading_rad)
        self.half_x = size[0] / 2.0
        self.half_y = size[1] / 2.0

    def gap(self, x: float, y: float) -> float:
        """Return the distance in meters from a point to the block; 0 for a point inside the block."""
        lx, ly = self._local(x, y)
        return math.hypot(max(abs(lx) - self.half_x, 0.0), max(abs(ly) - self.half_y, 0.0))

    def contact(self, x: float, y: float, radius: float) -> Contact | None:
        """Return the contact of a round robot at x, y with the block; None if they do not touch."""
        lx, ly = self._local(x, y)
        dx = lx - max(-self.half_x, min(self.half_x, lx))
        dy = ly - max(-self.half_y, min(self.half_y, ly))
        squared = dx * dx + dy * dy
        if squared >= radius * radius:
            return None
        if squared == 0.0:
            nx, ny, depth = self._way_out(lx, ly, radius)
        else:
            distance = math.sqrt(squared)
            nx, ny, depth = dx / distance, dy / distance, radius - distance
        return (nx * self.c - ny * self.s, nx * self.s + ny * self.c, depth)

    def scan(self, frame: tuple[float, float, float, float], rays: Sequence[Ray], reach: list[float]) -> None:
        """Shorten each `reach` to the distance at which its ray meets the block; the rays are in `frame`."""
        x, y = self._local(frame[0], frame[1])
        c = frame[2] * self.c + frame[3] * self.s
        s = frame[3] * self.c - frame[2] * self.s
        for i, (px, py, ux, uy) in enumerate(rays):
            enter_x, leave_x = _slab(x + px * c - py * s, ux * c - uy * s, self.half_x)
            enter_y, leave_y = _slab(y + px * s + py * c, ux * s + uy * c, self.half_y)
            enter = max(0.0, enter_x, enter_y)
            if enter <= leave_x and enter <= leave_y:
                reach[i] = min(reach[i], enter)

    def crossing(self, frame: tuple[float, float, float, float], ray: Ray) -> tuple[float, float]:
        """Return the distances in meters at which a ray enters and leaves the block; see `FlatObstacle`."""
        x, y = self._local(frame[0], frame[1])
        c = frame[2] * self.c + frame[3] * self.s
        s = frame[3] * self.c - frame[2] * self.s
        px, py, ux, uy = ray
        enter_x, leave_x = _slab(x + px * c - py * s, ux * c - uy * s, self.half_x)
        enter_y, leave_y = _slab(y + px * s + py * c, ux * s + uy * c, self.half_y)
        return max(enter_x, enter_y), min(leave_x, leave_y)

    def _local(self, x: float, y: float) -> tuple[float, float]:
        dx = x - self.x
        dy = y - self.y
        return dx * self.c + dy * self.s, dy * self.c - dx * self.s

    def _way_out(self, x: float, y: float, radius: float) -> Contact:
        """Return the contact of a robot with the nearest face; the robot's center is inside the block."""
        out_x = self.half_x - abs(x)
        out_y = self.half_y - abs(y)
        if out_x < out_y:
            return (math.copysign(1.0, x), 0.0, out_x + radius)
        return (0.0, math.copysign(1.0, y), out_y + radius)


class Hull:
    """The outline of a mesh: the convex polygon around its points, counter-clockwise."""

    __slots__ = ("corners", "x", "y")

    def __init__(self, points: Iterable[Point]) -> None:
        self.corners = _hull(points)
        self.x = sum(x for x, _ in self.corners) / len(self.corners)
        self.y = sum(y for _, y in self.corners) / len(self.corners)

    def gap(self, x: float, y: float) -> float:
        """Return the distance in meters from a point to the polygon; 0 for a point inside the polygon."""
        nearest_x, nearest_y, inside = self._nearest(x, y)
        return 0.0 if inside else math.hypot(x - nearest_x, y - nearest_y)

    def contact(self, x: float, y: float, radius: float) -> Contact | None:
        """Return the contact of a round robot at x, y with the polygon; None if they do not touch."""
        nearest_x, nearest_y, inside = self._nearest(x, y)
        distance = math.hypot(x - nearest_x, y - nearest_y)
        if not inside and distance >= radius:
            return None
        if distance * distance < _SAME_PLACE_M2:
            away = math.hypot(x - self.x, y - self.y) or 1.0
            return ((x - self.x) / away, (y - self.y) / away, radius)
        sign = -1.0 if inside else 1.0
        push = radius + distance if inside else radius - distance
        return (sign * (x - nearest_x) / distance, sign * (y - nearest_y) / distance, push)

    def scan(self, frame: tuple[float, float, float, float], rays: Sequence[Ray], reach: list[float]) -> None:
        """Shorten each `reach` to the distance at which its ray meets the polygon; rays are in `frame`."""
        for i, ray in enumerate(rays):
            enter, leave = self.crossing(frame, ray)
            if max(enter, 0.0) <= leave:
                reach[i] = min(reach[i], max(enter, 0.0))

    def crossing(self, frame: tuple[float, float, float, float], ray: Ray) -> tuple[float, float]:
        """Return the distances in meters at which a ray enters and leaves the polygon; see `FlatObstacle`."""
        x, y, c, s = frame
        px, py, ux, uy = ray
        at_x, at_y = x + c * px - s * py, y + s * px + c * py
        way_x, way_y = c * ux - s * uy, s * ux + c * uy
        enter, leave = -math.inf, math.inf
        for (ax, ay), (bx, by) in self._edges():
            beyond = (at_x - ax) * (by - ay) - (at_y - ay) * (bx - ax)  # positive: outside of the edge
            outward = way_x * (by - ay) - way_y * (bx - ax)
            if outward > 0.0:
                leave = min(leave, -beyond / outward)
            elif outward < 0.0:
                enter = max(enter, -beyond / outward)
            elif beyond > 0.0:
                return math.inf, -math.inf
        return enter, leave

    def _edges(self) -> Iterator[tuple[Point, Point]]:
        return zip(self.corners, (*self.corners[1:], self.corners[0]), strict=True)

    def _nearest(self, x: float, y: float) -> tuple[float, float, bool]:
        """Return the nearest point on the edges to the point x, y, and whether x, y is inside the polygon."""
        best, inside = (math.inf, 0.0, 0.0), True
        for (ax, ay), (bx, by) in self._edges():
            dx, dy = bx - ax, by - ay
            along = ((x - ax) * dx + (y - ay) * dy) / ((dx * dx + dy * dy) or 1.0)
            along = max(0.0, min(1.0, along))
            at_x, at_y = ax + along * dx, ay + along * dy
            best = min(best, (math.hypot(x - at_x, y - at_y), at_x, at_y))
            inside = inside and (x - ax) * dy - (y - ay) * dx <= 0.0
        return best[1], best[2], inside


def _hull(points: Iterable[Point]) -> list[Point]:
    """Return the corners of the convex hull of points, counter-clockwise, by Andrew's monotone chains."""
    ordered = sorted(set(points))
    if len(ordered) < len("abc"):
        return ordered
    return [*_chain(ordered), *_chain(ordered[::-1])]


def _chain(points: Iterable[Point]) -> list[Point]:
    """Return the lower half of a hull, without its last corner."""
    found: list[Point] = []
    for x, y in points:
        while len(found) > 1:
            (ax, ay), (bx, by) = found[-2:]
            if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0.0:
                break
            found.pop()
        found.append((x, y))
    return found[:-1]


def _slab(origin: float, direction: float, half: float) -> tuple[float, float]:
    """Return the distances at which a ray enters and leaves the range from -half to half."""
    if direction == 0.0:
        return (-math.inf, math.inf) if -half <= origin <= half else (math.inf, -math.inf)
    first = (-half - origin) / direction
    second = (half - origin) / direction
    return (first, second) if first < second else (second, first)


class Neighborhood:
    """Finds the obstacles near a point; the result is cached for each square of the floor.

    Most squares have at most one obstacle nearby, so a step takes the same time in a larger world.
    """

    __slots__ = ("_margin", "_obstacles", "_squares")

    SIDE_M = 0.125
    LIMIT = 20_000  # maximum number of cached squares; a robot that leaves the world must not fill the memory

    def __init__(self, obstacles: Sequence[FlatObstacle], reach_m: float) -> None:
        self._obstacles = tuple(obstacles)
        self._margin = reach_m + self.SIDE_M * math.sqrt(0.5)
        self._squares: dict[int, tuple[FlatObstacle, ...]] = {}

    def near(self, x: float, y: float) -> tuple[FlatObstacle, ...]:
        """Return all obstacles within reach of x, y, in their order; the result may contain others."""
        column = int(x * 8.0 + 4096.0)  # 8 = 1 / SIDE_M; the shift makes usual coordinates positive
        row = int(y * 8.0 + 4096.0)
        key = column * 65536 + row
        found = self._squares.get(key)
        return self._look(key, column, row) if found is None else found

    def _look(self, key: int, column: int, row: int) -> tuple[FlatObstacle, ...]:
        x = (column + 0.5) * self.SIDE_M - 512.0
        y = (row + 0.5) * self.SIDE_M - 512.0
        found = tuple(obstacle for obstacle in self._obstacles if obstacle.gap(x, y) <= self._margin)
        if len(self._squares) >= self.LIMIT:
            self._squares.clear()
        self._squares[key] = found
        return found
