"""Outlines, seen from above: discs, blocks and hulls of obstacles, and discs of robots.

A shape has one outline, which holds from its lower to its upper end. That is exact for boxes and for
cylinders that stand. Of others it is the widest outline, for contacts; rays meet their true surface.

A robot's outline is a set of discs, fixed in its frame. A disc keeps its shape however the robot turns, so a
contact costs the same at every heading. A box becomes a row of discs with its length, its width, and round
corners.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final, NamedTuple

from palaestra_sim.scene.geometry import Pose
from palaestra_sim.scene.shapes import Shape
from palaestra_sim.stub.obstacles import Block, Disc, Hull

_Z: Final = 2
_ALONG_Z: Final = frozenset(("cylinder", "capsule"))
_MOST_DISCS: Final = 16  # most discs of one box; in a bar over eight times as long as wide they have gaps


class RoundPart(NamedTuple):
    """A disc in the robot's frame: x and y of its center and its radius, in meters."""

    x_m: float
    y_m: float
    radius_m: float


def discs_of_box(
    x_m: float, y_m: float, heading_rad: float, length_m: float, width_m: float
) -> tuple[RoundPart, ...]:
    """Return discs that cover a box except its corners, and do not extend beyond the box.

    The box has its center at x, y and its length along the heading. The discs are on its longer axis, at most
    one radius apart, so a long side has dents of at most 7 % of the width.
    """
    if width_m > length_m:
        return discs_of_box(x_m, y_m, heading_rad + math.pi / 2.0, width_m, length_m)
    radius_m = width_m / 2.0
    row_m = length_m - width_m  # distance from the first center to the last
    gaps = _MOST_DISCS - 1
    if row_m < gaps * radius_m:
        gaps = math.ceil(row_m / radius_m)
    c = math.cos(heading_rad)
    s = math.sin(heading_rad)
    places = (row_m * (index / gaps - 0.5) if gaps else 0.0 for index in range(gaps + 1))
    return tuple(RoundPart(x_m + c * place, y_m + s * place, radius_m) for place in places)


def obstacle(shape: Shape) -> Disc | Block | Hull:
    """Return the outline of a shape, where it is now."""
    if shape.mesh is None:
        return _simple(shape)
    return Hull(shape.pose.carry(point)[:2] for point in shape.mesh.points)


def _simple(shape: Shape) -> Disc | Block:
    """Return a disc or a block around a shape; of a mesh, around its box."""
    pose = shape.pose
    x, y, _ = pose.position
    vertical = max(range(3), key=lambda axis: abs(pose.rotation[6 + axis]))
    if shape.kind == "ball" or (shape.kind in _ALONG_Z and vertical == _Z):
        return Disc(x, y, shape.size[0] / 2.0)
    heading_rad, length, width = _footprint(shape, pose, vertical)
    return Block(x, y, heading_rad, (length, width))


def prismatic(shape: Shape) -> bool:
    """Return whether the outline of a shape holds from its lower to its upper end."""
    return shape.kind == "box" or (shape.kind == "cylinder" and not shape.lies)


def covering(shapes: Iterable[Shape]) -> list[tuple[RoundPart, Shape]]:
    """Return the discs of a robot's outline with their shapes, without discs inside another one."""
    parts = [(part, shape) for shape in shapes for part in _discs(shape)]
    return [
        (part, shape)
        for index, (part, shape) in enumerate(parts)
        if not any(
            _inside(part, other) and (other != part or later > index)
            for later, (other, _) in enumerate(parts)
            if later != index
        )
    ]


def _footprint(shape: Shape, pose: Pose, vertical: int) -> tuple[float, float, float]:
    """Return the heading of one of its level axes, its extent along this one, and that across."""
    if shape.kind in _ALONG_Z:
        axis_rad = math.atan2(pose.rotation[3 + _Z], pose.rotation[_Z])
        return axis_rad - math.pi / 2.0, shape.size[0], shape.size[_Z]
    along, across = (axis for axis in range(3) if axis != vertical)
    heading_rad = math.atan2(pose.rotation[3 + along], pose.rotation[along])
    return heading_rad, shape.size[along], shape.size[across]


def _inside(inner: RoundPart, outer: RoundPart) -> bool:
    return math.hypot(inner[0] - outer[0], inner[1] - outer[1]) + inner[2] <= outer[2]


def _discs(shape: Shape) -> list[RoundPart]:
    outline = _simple(shape)
    if isinstance(outline, Disc):
        return [RoundPart(outline.x, outline.y, outline.radius)]
    length, width = 2.0 * outline.half_x, 2.0 * outline.half_y
    return list(discs_of_box(outline.x, outline.y, outline.heading_rad, length, width))
