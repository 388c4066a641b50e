"""The distance from a ray's origin to a shape, by formulas of school geometry.

Each function takes the origin and the unit direction of a ray, both (3,), in the frame of the shape. The
origin is outside the shape. The result is in meters, and infinite if the ray misses the shape.
"""

from __future__ import annotations

import numpy as np


def _roots(square, linear, constant):
    """Return the positive roots of `square` t2 + `linear` t + `constant`."""
    under = linear**2 - 4.0 * square * constant
    if square == 0.0 or under < 0.0:
        return []
    return [t for sign in (-1.0, 1.0) if (t := (-linear + sign * np.sqrt(under)) / (2.0 * square)) > 0.0]


def _first(candidates, holds):
    return min((t for t in candidates if holds(t)), default=np.inf)


def box(origin, direction, size):
    """Return the distance to a box: the nearest intersection with a face plane inside the other planes."""
    half = np.asarray(size) / 2.0
    slack = 1e-12
    candidates = [
        (side * half[axis] - origin[axis]) / direction[axis]
        for axis in range(3)
        for side in (-1.0, 1.0)
        if direction[axis]
    ]
    inside = lambda t: t > 0.0 and bool(np.all(np.abs(origin + t * direction) <= half + slack))  # noqa: E731
    return _first(candidates, inside)


def sphere(origin, direction, radius, center=(0.0, 0.0, 0.0)):
    """Return the distance to a sphere."""
    apart = origin - np.asarray(center)
    return min(_roots(1.0, 2.0 * apart @ direction, apart @ apart - radius**2), default=np.inf)


def tube(origin, direction, radius, height):
    """Return the distance to the side of a cylinder around z."""
    (x, y, _), (dx, dy, _) = origin, direction
    roots = _roots(dx**2 + dy**2, 2.0 * (x * dx + y * dy), x**2 + y**2 - radius**2)
    return _first(roots, lambda t: abs(origin[2] + t * direction[2]) <= height / 2.0)


def cylinder(origin, direction, radius, height):
    """Return the distance to a cylinder around z: its side, or one of its ends."""
    ends = [(end - origin[2]) / direction[2] for end in (-height / 2.0, height / 2.0) if direction[2]]
    on_end = lambda t: t > 0.0 and np.hypot(*(origin + t * direction)[:2]) <= radius  # noqa: E731
    return min(tube(origin, direction, radius, height), _first(ends, on_end))


def capsule(origin, direction, radius, height):
    """Return the distance to a capsule around z; `height` is the length of the cylinder between the caps."""
    caps = [sphere(origin, direction, radius, (0.0, 0.0, end)) for end in (-height / 2.0, height / 2.0)]
    return min(tube(origin, direction, radius, height), *caps)


def cone(origin, direction, radius, height):
    """Return the distance to a cone around z; the origin is halfway between the base and the tip above it."""
    slope = radius / height
    tip = np.array([0.0, 0.0, height / 2.0])
    apart = origin - tip
    weights = np.array([1.0, 1.0, -(slope**2)])
    roots = _roots(
        direction @ (weights * direction), 2.0 * apart @ (weights * direction), apart @ (weights * apart)
    )
    side = _first(roots, lambda t: abs(origin[2] + t * direction[2]) <= height / 2.0)
    bottom = [(-height / 2.0 - origin[2]) / direction[2]] if direction[2] else []
    on_end = lambda t: t > 0.0 and np.hypot(*(origin + t * direction)[:2]) <= radius  # noqa: E731
    return min(side, _first(bottom, on_end))


def plane(origin, direction):
    """Return the distance to the plane z = 0."""
    return _first([-origin[2] / direction[2]] if direction[2] else [], lambda t: t > 0.0)


def front_of_plane(origin, direction):
    """Return the distance to the upper side of the plane z = 0; infinite from below."""
    return plane(origin, direction) if origin[2] > 0.0 else np.inf


def triangles(origin, direction, corners):
    """Return the distance to triangles with these corners, an array of (n, 3, 3)."""
    nearest = np.inf
    for a, b, c in np.asarray(corners, float):
        matrix = np.stack([b - a, c - a, -direction], axis=1)
        if abs(np.linalg.det(matrix)) > 1e-12:
            u, v, t = np.linalg.solve(matrix, origin - a)
            if u >= 0.0 and v >= 0.0 and u + v <= 1.0 and t > 0.0:
                nearest = min(nearest, t)
    return nearest


def front_of_triangles(origin, direction, corners):
    """Return the distance to triangles on their outer sides, where the corners run counter-clockwise."""
    facing = [
        (a, b, c) for a, b, c in np.asarray(corners, float) if np.cross(b - a, c - a) @ (origin - a) > 0.0
    ]
    return triangles(origin, direction, facing)
