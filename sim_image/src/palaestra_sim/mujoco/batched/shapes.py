"""The objects on the floor of a world, as the trainer's `ObstacleReader` finds them over ROS."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from typing import Any, Final

from palaestra_protocol.batch import BatchShape
from palaestra_protocol.obstacle_shapes import (
    MOST_POINTS,
    ObstacleShape,
    PartFrame,
    ShapeReader,
    Turn,
    Vector,
    heading_of,
    is_round,
    tilt_of,
)
from palaestra_sim.scene.geometry import axis_angle_to_quaternion, to_quaternion
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.scene.tree.field_types import FieldType

log = logging.getLogger(__name__)

FLOOR: Final = "FLOOR"
_FLOOR_FIELDS: Final = {"RectangleArena": "floorSize", "Floor": "size"}


def shapes_of(simulation: Simulation) -> tuple[BatchShape, ...]:
    """Return the shapes of the Solids at the top of a world, in the order of the world."""
    reader = _Reader(simulation)
    found = tuple(reader.read())
    if reader.left_out:
        counts = ", ".join(f"{count} {kind}" for kind, count in sorted(reader.left_out.items()))
        log.warning("obstacles without a known size are not in the layout: %s", counts)
    return found


class _Reader(ShapeReader[SceneNode]):
    def __init__(self, simulation: Simulation) -> None:
        super().__init__()
        self._simulation = simulation

    def read(self) -> Iterator[BatchShape]:
        for node in self._simulation.tree.root.nodes():
            kind = self.kind(node)
            if kind in _FLOOR_FIELDS:
                x, y = self._value(node, _FLOOR_FIELDS[kind], FieldType.VEC2F)
                yield from self._shapes(FLOOR, node, [PartFrame().box((x, y, 0.0))])
            elif node.type_name == "Solid":
                tilt = tilt_of(_turn(node), self.scale(node))
                parts = list(self.parts(node, "boundingObject", tilt))
                yield from self._shapes(node.def_name, node, parts)

    def _shapes(self, name: str, node: SceneNode, parts: list[ObstacleShape]) -> Iterator[BatchShape]:
        x, y, z = self.vector(node, "translation")
        heading_rad = 0.0
        if name == FLOOR or not is_round(parts):
            heading_rad = heading_of(_turn(node))
        for part in parts:
            center, half = part.center, part.half
            yield BatchShape(
                name=name,
                x=x,
                y=y,
                z=z,
                heading_rad=heading_rad,
                center_x=center[0],
                center_y=center[1],
                center_z=center[2],
                half_x=half[0],
                half_y=half[1],
                half_z=half[2],
                radius=part.radius_m,
            )

    def nodes(self, node: SceneNode, field: str) -> tuple[SceneNode, ...]:
        """Return the nodes in a field."""
        return node.nodes(field)

    def points(self, coordinate: SceneNode) -> list[Vector]:
        """Return the points of a Coordinate; [] if it has more than `MOST_POINTS`."""
        field = self._simulation.tree.field_of(coordinate, "point", self._simulation)
        count = 0 if field is None else field.count
        if field is None or count > MOST_POINTS:
            return []
        return [field.get(FieldType.VEC3F, index) for index in range(count)]

    def kind(self, node: SceneNode) -> str:
        """Return the name of the node's PROTO, or else of its type."""
        return node.proto_name or node.type_name

    def vector(self, node: SceneNode, field: str) -> Vector:
        """Return the three numbers in a field."""
        found: Vector = self._value(node, field, FieldType.VEC3F)
        return found

    def rotation(self, node: SceneNode) -> Turn:
        """Return the field `rotation` as a quaternion."""
        return axis_angle_to_quaternion(self._value(node, "rotation", FieldType.ROTATION))

    def scale(self, node: SceneNode) -> Vector:
        """Return the field `scale`; ones if the node has no such field."""
        field = self._simulation.tree.field_of(node, "scale", self._simulation)
        return (1.0, 1.0, 1.0) if field is None else field.get(FieldType.VEC3F)

    def number(self, node: SceneNode, field: str) -> float:
        """Return the number in a field."""
        return float(self._value(node, field, FieldType.FLOAT))

    def _value(self, node: SceneNode, name: str, type_: FieldType) -> Any:
        field = self._simulation.tree.field_of(node, name, self._simulation)
        return (0.0, 0.0, 0.0) if field is None else field.get(type_)


def _turn(node: SceneNode) -> Turn:
    """Return the orientation of a node, as a client reads it over ROS."""
    return (0.0, 0.0, 0.0, 1.0) if node.place is None else to_quaternion(node.place.world_pose.rotation)
