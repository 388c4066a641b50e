"""Compute the exact distance along a ray to the surface of a shape. Pure geometry, in the frame of the shape.

A ray that begins inside a shape meets the surface where it leaves the shape, as in ODE, the physics engine of
Webots.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from palaestra_sim.scene.geometry import Vector
from palaestra_sim.scene.meshes import nearest_triangle
from palaestra_sim.scene.shapes import Shape

_NEVER: Final = (math.inf, -math.inf)


def first_hit(shape: Shape, origin: Vector, direction: Vector) -> float:
    """Return the meters from `origin` along a unit vector to the shape; infinite if the ray misses."""
    if shape.mesh is not None:
        return nearest_triangle(shape.mesh, origin, direction)
    enter, leave = _span(shape, origin, direction)
    if enter > leave or leave < 0.0:
        return math.inf
    return leave if enter < 0.0 else enter


def _span(shape: Shape, origin: Vector, direction: Vector) -> tuple[float, float]:
    """Return the distances at which a line enters and leaves a convex shape; if it misses, enter > leave."""
    half = shape.size[0] / 2.0, shape.size[1] / 2.0, shape.size[2] / 2.0
    match shape.kind:
        case "ball":
            return _in_ball(origin, direction, half[0])
        case "cylinder":
            return _in_both(
                _in_ball(origin[:2], direction[:2], half[0]), _in_slab(origin[2], direction[2], half[2])
            )
        case "capsule":
            return _in_capsule(origin, direction, half[0], max(half[2] - half[0], 0.0))
    x, y, z = (_in_slab(*of_axis) for of_axis in zip(origin, direction, half, strict=True))
    return _in_both(_in_both(x, y), z)


def _in_both(one: tuple[float, float], other: tuple[float, float]) -> tuple[float, float]:
    return max(one[0], other[0]), min(one[1], other[1])


def _in_capsule(origin: Vector, direction: Vector, radius: float, straight: float) -> tuple[float, float]:
    """Return the span of a line in a capsule, the convex union of a tube and the balls at its two ends."""
    x, y, z = origin
    parts = [
        _in_both(_in_ball((x, y), direction[:2], radius), _in_slab(z, direction[2], straight)),
        _in_ball((x, y, z - straight), direction, radius),
        _in_ball((x, y, z + straight), direction, radius),
    ]
    met = [part for part in parts if part[0] <= part[1]]
    return (min(met)[0], max(leave for _, leave in met)) if met else _NEVER


def _in_slab(origin: float, direction: float, half: float) -> tuple[float, float]:
    """Return the two distances at which a line enters and leaves the space between two planes."""
    if direction == 0.0:
        return (-math.inf, math.inf) if abs(origin) <= half else _NEVER
    ends = (-half - origin) / direction, (half - origin) / direction
    return min(ends), max(ends)


def _in_ball(origin: Sequence[float], direction: Sequence[float], radius: float) -> tuple[float, float]:
    """Return the two distances at which a line enters and leaves a ball, or, in two dimensions, a circle."""
    square = sum(part * part for part in direction)
    half_linear = sum(part * at for part, at in zip(direction, origin, strict=True))
    constant = sum(at * at for at in origin) - radius * radius
    if square == 0.0:
        return (-math.inf, math.inf) if constant <= 0.0 else _NEVER
    under = half_linear * half_linear - square * constant
    if under < 0.0:
        return _NEVER
    root = math.sqrt(under)
    return (-half_linear - root) / square, (-half_linear + root) / square
