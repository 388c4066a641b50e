"""The shapes of obstacles on a floor, which a trainer reads over ROS and a batch describes.

A box along the axes of its object, and a round shape that stands upright, have their exact size. A shape that
is turned or scaled in another way becomes the smallest box around it, so that it never has a free place
inside. So does a set of faces. The size of a Mesh is in a file, so readers leave such shapes out and report
them.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Final, Generic, NamedTuple, TypeAlias, TypeVar

Vector: TypeAlias = tuple[float, float, float]
Turn: TypeAlias = tuple[float, float, float, float]
"""A unit quaternion x, y, z, w."""
Rows: TypeAlias = tuple[Vector, Vector, Vector]

MOST_POINTS: Final = 2000  # a reader requests each point of a set of faces: a second for so many
_NOTHING: Final = 1e-9  # a smaller part of a unit vector or quaternion is a rounding error
_FACES: Final = frozenset(("IndexedFaceSet", "Extrusion"))  # the simulators convert an Extrusion to faces
_ORIGIN: Final[Vector] = (0.0, 0.0, 0.0)
_AXES: Final[Rows] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class ObstacleShape(NamedTuple):
    """A box or an upright cylinder: center in the object's frame, half the size, and radius (0 for a box)."""

    center: Vector
    half: Vector
    radius_m: float


class PartFrame(NamedTuple):
    """The frame of a part in an object: its origin in meters, and the rows of its rotation and scale."""

    center: Vector = _ORIGIN
    rows: Rows = _AXES

    def inside(self, translation: Vector, turn: Turn, scale: Vector) -> PartFrame:
        """Return the frame of a node in this frame, from the node's fields."""
        turned = _rows(turn)
        scaled = [(row[0] * scale[0], row[1] * scale[1], row[2] * scale[2]) for row in turned]
        x, y, z = (at + _dot(row, translation) for at, row in zip(self.center, self.rows, strict=True))
        return PartFrame((x, y, z), _product(self.rows, scaled))

    def box(self, size: Vector) -> ObstacleShape:
        """Return a Box of this size in meters."""
        x, y, z = (0.5 * _dot((abs(row[0]), abs(row[1]), abs(row[2])), size) for row in self.rows)
        return ObstacleShape(self.center, (x, y, z), 0.0)

    def cylinder(self, radius_m: float, height_m: float) -> ObstacleShape:
        """Return a Cylinder along the z axis of this frame."""
        x, y, z = (radius_m * math.hypot(*row[:2]) + 0.5 * height_m * abs(row[2]) for row in self.rows)
        if not self._is_upright:
            return ObstacleShape(self.center, (x, y, z), 0.0)
        return self._round(radius_m, 0.5 * height_m * abs(self.rows[2][2]))

    def capsule(self, radius_m: float, height_m: float) -> ObstacleShape:
        """Return a Capsule along the z axis of this frame; its height is that of its straight part."""
        x, y, z = (radius_m * math.hypot(*row) + 0.5 * height_m * abs(row[2]) for row in self.rows)
        return self._round(radius_m, z) if self._is_upright else ObstacleShape(self.center, (x, y, z), 0.0)

    def sphere(self, radius_m: float) -> ObstacleShape:
        """Return a Sphere."""
        return self._round(radius_m, radius_m * math.hypot(*self.rows[2]))

    def around(self, points: Sequence[Vector]) -> ObstacleShape:
        """Return the smallest box around points; there must be a point."""
        sides = [
            [at + _dot(row, point) for point in points]
            for at, row in zip(self.center, self.rows, strict=True)
        ]
        x, y, z = ((0.5 * (min(side) + max(side)), 0.5 * (max(side) - min(side))) for side in sides)
        return ObstacleShape((x[0], y[0], z[0]), (x[1], y[1], z[1]), 0.0)

    @property
    def _is_upright(self) -> bool:
        tilts = (self.rows[0][2], self.rows[1][2], *self.rows[2][:2])
        return max(map(abs, tilts)) < _NOTHING

    def _round(self, radius_m: float, half_m: float) -> ObstacleShape:
        widest = max(math.hypot(*row) for row in self.rows[:2])
        return ObstacleShape(self.center, (0.0, 0.0, half_m), radius_m * widest)


NodeT = TypeVar("NodeT")


class ShapeReader(ABC, Generic[NodeT]):
    """Reads the shapes of a boundingObject; a subclass reads the nodes, over ROS or in a simulation.

    Attributes:
        left_out: the number of shapes whose size no field has, by type; `parts` leaves them out.
    """

    def __init__(self) -> None:
        self.left_out = Counter[str]()

    def parts(self, node: NodeT, field: str, frame: PartFrame) -> Iterator[ObstacleShape]:
        """Yield the shapes in a field of a node, whose frame is `frame`; count other shapes in `left_out`."""
        for child in self.nodes(node, field):
            match self.kind(child):
                case "Shape":
                    yield from self.parts(child, "geometry", frame)
                case "Group":
                    yield from self.parts(child, "children", frame)
                case "Pose" | "Transform":
                    place = self.vector(child, "translation"), self.rotation(child), self.scale(child)
                    yield from self.parts(child, "children", frame.inside(*place))
                case "Plane":
                    pass  # a floor, or a ceiling, which no robot touches
                case kind:
                    shape = self._shape(child, kind, frame)
                    if shape is None:
                        self.left_out[kind] += 1
                    else:
                        yield shape

    def _shape(self, node: NodeT, kind: str, frame: PartFrame) -> ObstacleShape | None:
        """Return the shape of a geometry node; None if the fields of the node do not have its size."""
        match kind:
            case "Box":
                return frame.box(self.vector(node, "size"))
            case "Cylinder":
                return frame.cylinder(self.number(node, "radius"), self.number(node, "height"))
            case "Capsule":
                return frame.capsule(self.number(node, "radius"), self.number(node, "height"))
            case "Sphere":
                return frame.sphere(self.number(node, "radius"))
        faces = self.nodes(node, "coord") if kind in _FACES else ()
        points = [point for coordinate in faces for point in self.points(coordinate)]
        return frame.around(points) if points else None

    @abstractmethod
    def points(self, coordinate: NodeT) -> Sequence[Vector]:
        """Return the points of a Coordinate; an empty sequence if it has more than `MOST_POINTS`."""

    @abstractmethod
    def nodes(self, node: NodeT, field: str) -> Sequence[NodeT]:
        """Return the nodes in a field; an empty sequence if the node has no such field."""

    @abstractmethod
    def kind(self, node: NodeT) -> str:
        """Return the name of the node's PROTO, or else of its type."""

    @abstractmethod
    def number(self, node: NodeT, field: str) -> float:
        """Return the number in a field."""

    @abstractmethod
    def vector(self, node: NodeT, field: str) -> Vector:
        """Return the three numbers in a field."""

    @abstractmethod
    def rotation(self, node: NodeT) -> Turn:
        """Return the field `rotation` as a quaternion."""

    @abstractmethod
    def scale(self, node: NodeT) -> Vector:
        """Return the field `scale`; ones if the node has no such field."""


def is_round(shapes: Sequence[ObstacleShape]) -> bool:
    """Return whether a rotation about z does not change the outline of an object with these shapes."""
    return all(shape.radius_m and shape.center[:2] == (0.0, 0.0) for shape in shapes)


def heading_of(turn: Turn) -> float:
    """Return the rotation about z in an orientation, from -pi to pi."""
    return math.remainder(2.0 * math.atan2(turn[2], turn[3]), 2.0 * math.pi)


def tilt_of(turn: Turn, scale: Vector) -> PartFrame:
    """Return the frame of an object whose rotation about z is taken away; see `heading_of`."""
    if max(abs(turn[0]), abs(turn[1])) < _NOTHING:
        return PartFrame().inside(_ORIGIN, (0.0, 0.0, 0.0, 1.0), scale)
    heading_rad = heading_of(turn)
    back = (0.0, 0.0, -math.sin(heading_rad / 2.0), math.cos(heading_rad / 2.0))
    return PartFrame(rows=_rows(back)).inside(_ORIGIN, turn, scale)


def _rows(turn: Turn) -> Rows:
    """Return the matrix of a rotation."""
    x, y, z, w = turn
    return (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
        (2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)),
        (2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)),
    )


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _product(left: Rows, right: Sequence[Vector]) -> Rows:
    """Return the product of two matrices."""
    x, y, z = zip(*right, strict=True)
    first, second, third = ((_dot(row, x), _dot(row, y), _dot(row, z)) for row in left)
    return first, second, third
