"""The objects on the floor of a world, as the trainer's `ObstacleReader` finds them over ROS."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Final, NamedTuple

from palaestra_protocol.batch import BatchShape
from palaestra_sim.scene.geometry import Vector, to_quaternion
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.scene.tree.field_types import FieldType

FLOOR: Final = "FLOOR"
_FLOOR_FIELDS: Final = {"RectangleArena": "floorSize", "Floor": "size"}
_ROUND: Final = ("Cylinder", "Capsule", "Sphere")
_WRAPPERS: Final = ("Pose", "Transform", "Group", "Shape")
_CENTER: Final = (0.0, 0.0, 0.0)


class _Part(NamedTuple):
    """A shape of an object: its center and half its size in the object's frame, and its radius."""

    center: Vector
    half: Vector
    radius: float


def shapes_of(simulation: Simulation) -> tuple[BatchShape, ...]:
    """Return the shapes of the Solids at the top of a world, in the order of the world."""
    return tuple(_Reader(simulation).read())


class _Reader:
    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation

    def read(self) -> Iterator[BatchShape]:
        for node in self._simulation.tree.root.nodes():
            kind = node.proto_name or node.type_name
            if kind in _FLOOR_FIELDS:
                x, y = self._value(node, _FLOOR_FIELDS[kind], FieldType.VEC2F)
                parts = [_Part(_CENTER, (0.5 * x, 0.5 * y, 0.0), 0.0)]
                yield from self._shapes(FLOOR, node, parts)
            elif node.type_name == "Solid":
                parts = list(self._parts(node.nodes("boundingObject"), _CENTER))
                yield from self._shapes(node.def_name, node, parts)

    def _shapes(self, name: str, node: SceneNode, parts: list[_Part]) -> Iterator[BatchShape]:
        x, y, z = self._value(node, "translation", FieldType.VEC3F)
        heading_rad = 0.0 if name == FLOOR else _heading(node, parts)
        for center, half, radius in parts:
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
                radius=radius,
            )

    def _parts(self, nodes: tuple[SceneNode, ...], center: Vector) -> Iterator[_Part]:
        for node in nodes:
            kind = node.proto_name or node.type_name
            if kind in _WRAPPERS:
                inner = center
                if kind in {"Pose", "Transform"}:
                    x, y, z = self._value(node, "translation", FieldType.VEC3F)
                    inner = (center[0] + x, center[1] + y, center[2] + z)
                yield from self._parts(node.nodes("geometry" if kind == "Shape" else "children"), inner)
            elif kind == "Box":
                x, y, z = self._value(node, "size", FieldType.VEC3F)
                yield _Part(center, (0.5 * x, 0.5 * y, 0.5 * z), 0.0)
            elif kind in _ROUND:
                radius = self._value(node, "radius", FieldType.FLOAT)
                height = 0.0 if kind == "Sphere" else self._value(node, "height", FieldType.FLOAT)
                ends = 0.0 if kind == "Cylinder" else radius
                yield _Part(center, (0.0, 0.0, 0.5 * height + ends), radius)

    def _value(self, node: SceneNode, name: str, type_: FieldType) -> Any:
        field = self._simulation.tree.field_of(node, name, self._simulation)
        return _CENTER if field is None else field.get(type_)


def _heading(node: SceneNode, parts: list[_Part]) -> float:
    if all(part.radius and part.center[:2] == (0.0, 0.0) for part in parts) or node.place is None:
        return 0.0  # a rotation about z does not change the outline
    _, _, z, w = to_quaternion(node.place.world_pose.rotation)
    return math.remainder(2.0 * math.atan2(z, w), 2.0 * math.pi)
