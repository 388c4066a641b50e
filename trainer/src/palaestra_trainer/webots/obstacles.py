"""Read the objects in a world from its nodes, through the supervisor.

An object is a Solid at the top of the scene tree whose boundingObject consists of boxes, cylinders, capsules
and spheres. The shapes of an object are read once after each start. The position of an object is read at
every `read`, so a moved object has its current position. The floor is the Solid with DEF `FLOOR` and a box,
or a RectangleArena or Floor of Webots. The reader ignores Solids inside other nodes, and Solids that a
program adds while the simulation runs.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

from palaestra_trainer.errors import WorldMisfit
from palaestra_trainer.webots.services import Services

FLOOR = "FLOOR"  # the DEF name of the floor in a world
FLOOR_REMEDY = (
    "write DEF FLOOR before the Solid that is the floor and give it a Box as its boundingObject, or use a"
    " RectangleArena"
)
_FLOOR_FIELDS = {
    "RectangleArena": "floorSize",
    "Floor": "size",
}  # the field that holds the size, for each PROTO of Webots
_ROUND = ("Cylinder", "Capsule", "Sphere")
_WRAPPERS = ("Pose", "Transform", "Group", "Shape")

Vector = tuple[float, float, float]


class ObstacleShape(NamedTuple):
    """A box or an upright cylinder: center in the object's frame, half the size, and radius (0 for a box)."""

    center: Vector
    half: Vector
    radius_m: float


class Thing(NamedTuple):
    """An object: DEF name or "", position, rotation about z (0 for the floor), and shapes."""

    name: str
    place: Vector
    heading_rad: float
    shapes: tuple[ObstacleShape, ...]


class _Known(NamedTuple):
    """The constant data of an object; `translation` is a handle, 0 if the object has no such field."""

    name: str
    node: int
    translation: int
    shapes: tuple[ObstacleShape, ...]


class ObstacleReader:
    """Reads the objects of a world.

    Args:
        services: the services of the supervisor.
    """

    def __init__(self, services: Services) -> None:
        self._services = services
        self._things: list[_Known] | None = None

    def forget(self) -> None:
        """Drop the known nodes, because handles become invalid when the world is reloaded."""
        self._things = None

    def read(self) -> list[Thing]:
        """Return all objects at their current positions; the floor has the name `FLOOR`.

        Raises:
            WorldMisfit: the world has no floor.
            SimulatorDead, SimulatorHung, WrongData
        """
        if self._things is None:
            self._things = list(self._find())
        if not any(known.name == FLOOR for known in self._things):
            raise WorldMisfit(
                self._services.node_name,
                f"the world has no floor; {FLOOR_REMEDY}",
            )
        return [
            Thing(known.name, self._place(known), self._heading(known), known.shapes)
            for known in self._things
        ]

    def _find(self) -> Iterator[_Known]:
        for node in self._nodes(self._ask("supervisor/get_root", "get_uint64", ask=True).value, "children"):
            kind = self._kind(node)
            if kind in _FLOOR_FIELDS:
                size = self._vector(node, _FLOOR_FIELDS[kind], "vec2f")
                shape = ObstacleShape((0.0, 0.0, 0.0), (0.5 * size[0], 0.5 * size[1], 0.0), 0.0)
                yield _Known(FLOOR, node, self._field(node, "translation"), (shape,))
            elif self._ask("supervisor/node/get_base_type_name", "node_get_name", node=node).name == "Solid":
                shapes = tuple(self._shapes(node, "boundingObject", (0.0, 0.0, 0.0)))
                if shapes:
                    name = self._ask("supervisor/node/get_def", "node_get_name", node=node).name
                    yield _Known(name, node, self._field(node, "translation"), shapes)

    def _shapes(self, node: int, field: str, center: Vector) -> Iterator[ObstacleShape]:
        for child in self._nodes(node, field):
            kind = self._kind(child)
            if kind in _WRAPPERS:
                inner = center
                if kind in ("Pose", "Transform"):
                    x, y, z = self._vector(child, "translation", "vec3f")
                    inner = (center[0] + x, center[1] + y, center[2] + z)
                yield from self._shapes(child, "geometry" if kind == "Shape" else "children", inner)
            elif kind == "Box":
                x, y, z = self._vector(child, "size", "vec3f")
                yield ObstacleShape(center, (0.5 * x, 0.5 * y, 0.5 * z), 0.0)
            elif kind in _ROUND:
                radius_m = self._number(child, "radius")
                height_m = 0.0 if kind == "Sphere" else self._number(child, "height")
                ends_m = 0.0 if kind == "Cylinder" else radius_m
                yield ObstacleShape(center, (0.0, 0.0, 0.5 * height_m + ends_m), radius_m)

    def _place(self, known: _Known) -> Vector:
        if not known.translation:
            return (0.0, 0.0, 0.0)
        return self._value(known.translation, "vec3f")

    def _heading(self, known: _Known) -> float:
        if known.name == FLOOR:
            return 0.0  # the sides of a floor are parallel to the axes of the world
        if all(shape.radius_m and shape.center[:2] == (0.0, 0.0) for shape in known.shapes):
            return 0.0  # a rotation about z does not change the outline
        orientation = self._ask("supervisor/node/get_orientation", "node_get_orientation", node=known.node)
        turn = orientation.orientation
        return math.remainder(2.0 * math.atan2(turn.z, turn.w), 2.0 * math.pi)

    def _nodes(self, node: int, name: str) -> list[int]:
        """Return the nodes in a field; [] if the node has no such field."""
        field = self._field(node, name)
        if not field:
            return []
        several = name == "children"
        count = (
            self._ask("supervisor/field/get_count", "field_get_count", field=field).count if several else 1
        )
        got = (
            self._ask("supervisor/field/get_node", "field_get_node", field=field, index=index).node
            for index in range(count)
        )
        return [found for found in got if found]

    def _kind(self, node: int) -> str:
        return str(self._ask("supervisor/node/get_type_name", "node_get_name", node=node).name)

    def _field(self, node: int, name: str) -> int:
        return int(self._ask("supervisor/node/get_field", "node_get_field", node=node, fieldName=name).field)

    def _number(self, node: int, name: str) -> float:
        field = self._field(node, name)
        return float(self._ask("supervisor/field/get_float", "field_get_float", field=field).value)

    def _vector(self, node: int, name: str, kind: str) -> Vector:
        return self._value(self._field(node, name), kind)

    def _value(self, field: int, kind: str) -> Vector:
        value = self._ask(f"supervisor/field/get_{kind}", f"field_get_{kind}", field=field).value
        return (value.x, value.y, value.z)

    def _ask(self, path: str, type_name: str, **fields: Any) -> Any:
        return self._services.get(path, type_name)(**fields)
