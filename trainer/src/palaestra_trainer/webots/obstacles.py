"""Read the objects in a world from its nodes, through the supervisor.

An object is a Solid at the top of the scene tree whose boundingObject consists of boxes, cylinders, capsules,
spheres and sets of faces. A warning reports other shapes, which the reader leaves out. The shapes of an
object are read once after each start. The position of an object is read at every `read`, so a moved object
has its current position. The floor is the Solid with DEF `FLOOR` and a box, or a RectangleArena or Floor of
Webots. The reader ignores Solids inside other nodes, and Solids that a program adds while the simulation
runs.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any, NamedTuple

import structlog

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
from palaestra_trainer.errors import WorldMisfit
from palaestra_trainer.webots.services import Services

log = structlog.get_logger(__name__)

FLOOR = "FLOOR"  # the DEF name of the floor in a world
FLOOR_REMEDY = (
    "write DEF FLOOR before the Solid that is the floor and give it a Box as its boundingObject, or use a"
    " RectangleArena"
)
_FLOOR_FIELDS = {
    "RectangleArena": "floorSize",
    "Floor": "size",
}  # the field that holds the size, for each PROTO of Webots


class Thing(NamedTuple):
    """An object: DEF name or "", position, rotation about z, and shapes."""

    name: str
    place: Vector
    heading_rad: float
    shapes: tuple[ObstacleShape, ...]


class _Known(NamedTuple):
    """The constant data of an object.

    `translation` is a handle, 0 if the object has no such field. `heading_rad` is None if the rotation about
    z changes the outline, so that it is read each time.
    """

    name: str
    node: int
    translation: int
    heading_rad: float | None
    shapes: tuple[ObstacleShape, ...]


class ObstacleReader(ShapeReader[int]):
    """Reads the objects of a world.

    Args:
        services: the services of the supervisor.
    """

    def __init__(self, services: Services) -> None:
        super().__init__()
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
            self._things = self._find_all()
        if not any(known.name == FLOOR for known in self._things):
            raise WorldMisfit(
                self._services.node_name,
                f"the world has no floor; {FLOOR_REMEDY}",
            )
        return [
            Thing(known.name, self._place(known), self._heading(known), known.shapes)
            for known in self._things
        ]

    def _find_all(self) -> list[_Known]:
        """Return all objects; warn of shapes without a known size, but not again after each start."""
        before, self.left_out = self.left_out, Counter()
        found = list(self._find())
        if self.left_out != before:
            log.warning("obstacles without a known size are not in the layout", shapes=dict(self.left_out))
        return found

    def _find(self) -> Iterator[_Known]:
        for node in self.nodes(self._ask("supervisor/get_root", "get_uint64", ask=True).value, "children"):
            kind = self.kind(node)
            if kind in _FLOOR_FIELDS:
                x, y, _ = self._value(self._field(node, _FLOOR_FIELDS[kind]), "vec2f")
                yield self._known(FLOOR, node, (PartFrame().box((x, y, 0.0)),))
            elif self._ask("supervisor/node/get_base_type_name", "node_get_name", node=node).name == "Solid":
                shapes = tuple(
                    self.parts(node, "boundingObject", tilt_of(self._turn(node), self.scale(node)))
                )
                if shapes:
                    name = self._ask("supervisor/node/get_def", "node_get_name", node=node).name
                    yield self._known(name, node, shapes)

    def _known(self, name: str, node: int, shapes: tuple[ObstacleShape, ...]) -> _Known:
        heading_rad = None
        if name == FLOOR:
            heading_rad = heading_of(self._turn(node))
        elif is_round(shapes):
            heading_rad = 0.0
        return _Known(name, node, self._field(node, "translation"), heading_rad, shapes)

    def rotation(self, node: int) -> Turn:
        """Return the field `rotation` as a quaternion."""
        found = self._ask(
            "supervisor/field/get_rotation", "field_get_rotation", field=self._field(node, "rotation")
        ).value
        return (found.x, found.y, found.z, found.w)

    def scale(self, node: int) -> Vector:
        """Return the scale of a node; only a Transform and old forms of a Solid have this field."""
        field = self._field(node, "scale")
        return self._value(field, "vec3f") if field else (1.0, 1.0, 1.0)

    def _turn(self, node: int) -> Turn:
        answer = self._ask("supervisor/node/get_orientation", "node_get_orientation", node=node)
        turn = answer.orientation
        return (turn.x, turn.y, turn.z, turn.w)

    def _place(self, known: _Known) -> Vector:
        if not known.translation:
            return (0.0, 0.0, 0.0)
        return self._value(known.translation, "vec3f")

    def _heading(self, known: _Known) -> float:
        return heading_of(self._turn(known.node)) if known.heading_rad is None else known.heading_rad

    def nodes(self, node: int, field: str) -> list[int]:
        """Return the nodes in a field; [] if the node has no such field."""
        handle = self._field(node, field)
        if not handle:
            return []
        count = self._count(handle) if field == "children" else 1
        got = (
            self._ask("supervisor/field/get_node", "field_get_node", field=handle, index=index).node
            for index in range(count)
        )
        return [found for found in got if found]

    def kind(self, node: int) -> str:
        """Return the name of the node's PROTO, or else of its type."""
        return str(self._ask("supervisor/node/get_type_name", "node_get_name", node=node).name)

    def _field(self, node: int, name: str) -> int:
        return int(self._ask("supervisor/node/get_field", "node_get_field", node=node, fieldName=name).field)

    def number(self, node: int, field: str) -> float:
        """Return the number in a field."""
        handle = self._field(node, field)
        return float(self._ask("supervisor/field/get_float", "field_get_float", field=handle).value)

    def vector(self, node: int, field: str) -> Vector:
        """Return the three numbers in a field."""
        return self._value(self._field(node, field), "vec3f")

    def points(self, coordinate: int) -> list[Vector]:
        """Return the points of a Coordinate; [] if it has more than `MOST_POINTS`."""
        field = self._field(coordinate, "point")
        count = self._count(field) if field else 0
        return [self._value(field, "vec3f", index) for index in range(count if count <= MOST_POINTS else 0)]

    def _count(self, field: int) -> int:
        return int(self._ask("supervisor/field/get_count", "field_get_count", field=field).count)

    def _value(self, field: int, kind: str, index: int = 0) -> Vector:
        value = self._ask(f"supervisor/field/get_{kind}", f"field_get_{kind}", field=field, index=index).value
        return (value.x, value.y, value.z)

    def _ask(self, path: str, type_name: str, **fields: Any) -> Any:
        return self._services.get(path, type_name)(**fields)
