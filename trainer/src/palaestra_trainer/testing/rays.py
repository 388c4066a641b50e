"""Compute the distances along rays to walls, rectangles and circles, for the sensors of the fakes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palaestra_trainer.robots.layout import FloorLayout, Obstacle

_LEAST_SLOPE = 1e-9
Rays = NDArray[np.float64]
Eye = tuple[float, float] | tuple[Rays, Rays]


def nearest(layout: FloorLayout, origin: Eye, angles: NDArray[np.floating[Any]]) -> Rays:
    """Return the meters along each ray to the nearest wall or obstacle.

    Args:
        layout: the floor with its obstacles; walls stand at the edges of the floor.
        origin: x, y in meters of the origin of the rays; two numbers for all rays, or two arrays with a
            number for each ray.
        angles: directions of the rays in the world, in radians.
    """
    way = np.cos(angles), np.sin(angles)
    seen = _to_edges(layout, origin, way)
    for thing in layout.obstacles:
        if thing.standing:
            seen = np.minimum(seen, _to_thing(thing, origin, way))
    return seen


def _to_edges(layout: FloorLayout, origin: Eye, way: tuple[Rays, Rays]) -> Rays:
    """Return meters along each ray to the walls at the edges of the floor."""
    seen = np.full(len(way[0]), math.inf)
    for axis in (0, 1):
        slope = _sloping(way[axis])
        edge = np.where(slope > 0.0, layout.high[axis], layout.low[axis])
        seen = np.minimum(seen, (edge - origin[axis]) / slope)
    return seen


def _to_thing(thing: Obstacle, origin: Eye, way: tuple[Rays, Rays]) -> Rays:
    """Return the meters along each ray to a circle or a rectangle; infinite if the ray misses it."""
    c, s = math.cos(thing.heading_rad), math.sin(thing.heading_rad)
    dx, dy = origin[0] - thing.x_m, origin[1] - thing.y_m
    x, y = dx * c + dy * s, dy * c - dx * s
    ux, uy = way[0] * c + way[1] * s, way[1] * c - way[0] * s
    if thing.radius_m:
        along = -(x * ux + y * uy)
        inside = thing.radius_m**2 - (x * uy - y * ux) ** 2
        near = along - np.sqrt(np.maximum(inside, 0.0))
        return np.where((inside > 0.0) & (near > 0.0), near, math.inf)
    enter, leave = np.full(len(ux), -math.inf), np.full(len(ux), math.inf)
    for place, slope, half in ((x, _sloping(ux), thing.half_m[0]), (y, _sloping(uy), thing.half_m[1])):
        one, other = (-half - place) / slope, (half - place) / slope
        enter, leave = np.maximum(enter, np.minimum(one, other)), np.minimum(leave, np.maximum(one, other))
    return np.where((enter < leave) & (enter > 0.0), enter, math.inf)


def _sloping(slope: Rays) -> Rays:
    """Replace slopes of 0 by tiny slopes, because slopes are used as divisors."""
    return np.copysign(np.maximum(np.abs(slope), _LEAST_SLOPE), slope)
