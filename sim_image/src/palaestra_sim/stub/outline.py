"""The outlines of shapes as seen from above: discs, blocks and hulls of obstacles, and discs of robots.

A shape has one outline for its whole height. This outline is exact for boxes and for upright cylinders. Any
other shape is narrower than its outline at some heights: contacts use the outline, but rays meet the true
surface of the shape.

The outline of a robot is a set of discs that are fixed in the robot's frame. A disc looks the same at every
heading, so the check for a contact takes the same time at every heading. A box is replaced by a row of discs
with the length and width of the box; its corners become round.
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
# Maximum number of discs for one box. If a box is over eight times as long as wide, its discs are
# more than one radius apart.
_MOST_DISCS: Final = 16


class RoundPart(NamedTuple):
    """A disc in the robot's frame: x and y of its center and its radius, in meters."""

    x_m: float
    y_m: float
    radius_m: float


def discs_of_box(
    x_m: float, y_m: float, heading_rad: float, length_m: float, width_m: float
) -> tuple[RoundPart, ...]:
    """Return discs that cover a box except its corners, and that do not extend beyond the box.

    The center of the box is at x, y; its length is along the heading. The discs are on the longer axis, at
    most one radius apart if the box is at most eight times as long as wide. The outline of a long side then
    has dents of at most 7 % of the width.
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
    """Return the outline of a shape at its current pose."""
    if shape.mesh is None:
        return _simple(shape)
    return Hull(shape.pose.carry(point)[:2] for point in shape.mesh.points)


def _simple(shape: Shape) -> Disc | Block:
    """Return a disc or a block around a shape; for a mesh, around its bounding box."""
    pose = shape.pose
    x, y, _ = pose.position
    vertical = max(range(3), key=lambda axis: abs(pose.rotation[6 + axis]))
    if shape.kind == "ball" or (shape.kind in _ALONG_Z and vertical == _Z):
        return Disc(x, y, shape.size[0] / 2.0)
    heading_rad, length, width = _footprint(shape, pose, vertical)
    return Block(x, y, heading_rad, (length, width))


def covering(shapes: Iterable[Shape]) -> list[tuple[RoundPart, Shape]]:
    """Return the discs of a robot's outline with their shapes; a disc inside another disc is left out."""
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
    """Return the heading of a horizontal axis of a shape, and the extents along and across this axis."""
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
