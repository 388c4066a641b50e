"""The targets of radars: Solids with a `radarCrossSection`, and the shapes that hide them. Pure geometry.

The size of a Solid is the size of the box around its shapes, along the axes of the radar. A Solid without
shapes is a point. Parts outside the field of view do not count. Floors and the radar's own robot hide no
target.
Source: WbObjectDetection.cpp of Webots; Webots cuts boxes at the edge of the field of view by their corners.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Pose, Vector
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.outlines import Outlines, free_path
from palaestra_sim.scene.shapes import Shape


class Bounds(NamedTuple):
    """A box along the axes of a radar: its middle and its size in meters, in the frame of the radar."""

    middle: Vector
    size: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RadarTarget:
    """A Solid that radars can see.

    Attributes:
        place: the frame of the Solid.
        cross_section_m2: the Solid's `radarCrossSection`.
        shapes: the shapes of the Solid and of all Solids inside it.
        nodes: the Solid and all nodes inside it.
    """

    place: Frame
    cross_section_m2: float
    shapes: tuple[Shape, ...]
    nodes: frozenset[SceneNode]

    def seen_from(self, radar: Pose, field_of_view_rad: tuple[float, float]) -> Bounds | None:
        """Return the box around the target's part in a field of view; None if the target is outside.

        `radar` is the pose of the radar in the axes of the ground. `field_of_view_rad` has the horizontal and
        the vertical angle.
        """
        frame = radar.inverse
        boxes = [_box(frame.after(shape.pose), shape) for shape in self.shapes]
        if not boxes:
            boxes = [Bounds(frame.carry(self.place.ground_pose.position))]
        cut = (_cut(box, *field_of_view_rad) for box in boxes)
        return _around([box for box in cut if box is not None])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RadarTargets:
    """The targets of the radars of a world.

    Attributes:
        targets: the targets, in the order of the world file.
        shapes: all shapes that may hide the targets.
    """

    targets: tuple[RadarTarget, ...] = ()
    shapes: tuple[Shape, ...] = ()

    def free_path(self, target: RadarTarget, start: Vector, robot: frozenset[SceneNode]) -> float:
        """Return the distance from `start`, toward the origin of a target, to the first obstacle.

        The distance is in meters, and infinite without an obstacle. `robot` contains the nodes of the robot
        that carries the radar.
        """
        others = (it for it in self.shapes if it.node not in target.nodes and it.node not in robot)
        return free_path(others, start, target.place.ground_pose.position)


def echoes_of(nodes: Collection[SceneNode], outlines: Outlines) -> RadarTargets:
    """Return the current radar targets among `nodes`, whose outlines are in `outlines`."""
    shapes = outlines.shapes
    targets = []
    for node in nodes:
        cross_section = (node.numbers("radarCrossSection") or (0.0,))[0]
        if node.place is not None and not node.left_out and cross_section > 0.0:
            inside = (node, *node.descendants())
            targets.append(
                RadarTarget(
                    place=node.place,
                    cross_section_m2=cross_section,
                    shapes=tuple(shape for it in inside for shape in shapes.get(it, ())),
                    nodes=frozenset(inside),
                )
            )
    return RadarTargets(targets=tuple(targets), shapes=outlines.all)


def _box(pose: Pose, shape: Shape) -> Bounds:
    """Return the box around a shape that has this pose in the frame of the radar."""
    x, y, z = (2.0 * shape.half_along(pose.rotation, axis) for axis in range(3))
    return Bounds(pose.position, (x, y, z))


def _cut(box: Bounds, across_rad: float, up_rad: float) -> Bounds | None:
    """Return the part of a box in the field of view; None if no part is in it."""
    (x, y, z), (depth, width, height) = box
    cuts = [
        *_beyond(x, y, width, across_rad / 2.0),
        *_beyond(x, z, height, up_rad / 2.0),
    ]
    if any(cut is None for cut in cuts):
        return None
    left, right, top, bottom = (cut or 0.0 for cut in cuts)
    if across_rad > math.pi / 2.0:
        return box  # Webots does not cut boxes at such a wide field of view
    middle = (x, y + (right - left) / 2.0, z + (bottom - top) / 2.0)
    return Bounds(middle, (depth, max(0.0, width - left - right), max(0.0, height - top - bottom)))


def _beyond(ahead: float, aside: float, size: float, half_rad: float) -> Iterator[float | None]:
    """Yield the length of a box beyond each edge of the view, the positive edge first; None if outside."""
    for side in (-aside, aside):
        inside = math.sin(half_rad) * ahead + math.cos(half_rad) * side
        yield None if inside < -size / 2.0 else max(0.0, size / 2.0 - inside)


def _around(boxes: Sequence[Bounds]) -> Bounds | None:
    if not boxes:
        return None
    low, high = (
        [fold(middle[axis] + sign * size[axis] / 2.0 for middle, size in boxes) for axis in range(3)]
        for fold, sign in ((min, -1.0), (max, 1.0))
    )
    (x, y, z), (depth, width, height) = (
        [(b + a) / 2.0 for a, b in zip(low, high, strict=True)],
        [b - a for a, b in zip(low, high, strict=True)],
    )
    return Bounds((x, y, z), (depth, width, height))
