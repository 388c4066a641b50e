"""The shapes of all boundingObjects of a world, and the free path between two points.

Radars and light sensors use both. Pure geometry, in the axes of the ground.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass

from palaestra_sim.scene.geometry import Vector
from palaestra_sim.scene.hits import first_hit
from palaestra_sim.scene.mesh_files import MeshFiles
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.shapes import Shape, bounding_shapes
from palaestra_sim.scene.validation import NodeReader


@dataclass(frozen=True, slots=True, kw_only=True)
class Outlines:
    """The shapes and the floors of a world.

    Attributes:
        shapes: the shapes of each Solid, robot and device with a boundingObject, but not the shapes of their
            parts.
        floors_m: returns the current heights of the floors.
    """

    shapes: dict[SceneNode, tuple[Shape, ...]]
    floors_m: Callable[[], tuple[float, ...]]

    @property
    def all(self) -> tuple[Shape, ...]:
        """The shapes of all nodes."""
        return tuple(shape for several in self.shapes.values() for shape in several)


def outlines_of(
    nodes: Collection[SceneNode], floors_m: Callable[[], tuple[float, ...]], mesh_files: MeshFiles
) -> Outlines:
    """Return the outlines of these nodes.

    Args:
        nodes: the nodes of the world.
        floors_m: returns the heights of the floors in meters.
        mesh_files: the mesh files that the nodes name.
    """
    reading = NodeReader(mesh_files=mesh_files)  # the world was checked when it was loaded
    shapes = {
        node: tuple(bounding_shapes(reading, node, node.place))
        for node in nodes
        if node.place is not None and not node.left_out and node.nodes("boundingObject")
    }
    return Outlines(shapes=shapes, floors_m=floors_m)


def robot_around(node: SceneNode) -> frozenset[SceneNode]:
    """Return the nodes of the robot that carries a device; without a robot, the nodes of the device."""
    robot = next((it for it in node.ancestors() if it.type_name == "Robot"), node)
    return frozenset((robot, *robot.descendants()))


def free_path(shapes: Iterable[Shape], start: Vector, end: Vector) -> float:
    """Return the meters from `start` toward `end` to the first shape; infinite if the line meets none."""
    way = (end[0] - start[0], end[1] - start[1], end[2] - start[2])
    length = math.hypot(*way)
    if length == 0.0:
        return math.inf
    direction = (way[0] / length, way[1] / length, way[2] / length)
    nearest = min((_entry(shape, start, direction) for shape in shapes), default=math.inf)
    return nearest if nearest < length else math.inf


def _entry(shape: Shape, start: Vector, direction: Vector) -> float:
    """Return the distance in meters at which a ray meets a shape; infinite if the ray misses the shape."""
    frame = shape.pose.inverse
    return first_hit(shape, frame.carry(start), frame.turned(direction))
