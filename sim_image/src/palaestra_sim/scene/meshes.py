"""Triangle meshes, from the points and faces in a world, or from a shape. Pure."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Final, NamedTuple

from palaestra_sim.scene.geometry import Vector, cross, dot, minus, weighted_mean
from palaestra_sim.scene.nodes.scene_node import SceneNode

CORNERS: Final = 3
"""Number of corners of a triangle."""
MOST_M: Final = 1e5
"""Largest absolute value of a coordinate."""
_SIDES: Final = 20  # number of sides of a cone
_FEW: Final = 4  # a face with up to this many corners is treated as convex
_PARALLEL: Final = 1e-12
_THIN_M: Final = 1e-4  # a mesh that is thinner than this counts as flat
_SHEET_M: Final = 1e-3

_FEW_TRIANGLES: Final = 8  # a part with up to this number of triangles is not divided further
_SLACK_M: Final = 1e-9  # tolerance for a ray along the side of a box

Triangle = tuple[int, int, int]
Corners = tuple[Vector, Vector, Vector]


@dataclass(frozen=True, slots=True)
class Mesh:
    """Triangles, counterclockwise as seen from outside; `points` in meters."""

    points: tuple[Vector, ...]
    triangles: tuple[Triangle, ...]
    _parts: list[_Part] = field(default_factory=list, init=False, repr=False, compare=False)
    _turned: list[Mesh] = field(default_factory=list, init=False, repr=False, compare=False)

    @property
    def turned(self) -> Mesh:
        """The same triangles, clockwise as seen from outside; this mesh is built at the first use."""
        if not self._turned:
            self._turned.append(Mesh(self.points, tuple((a, c, b) for a, b, c in self.triangles)))
        return self._turned[0]

    @property
    def whole(self) -> _Part:
        """The bounding-box tree of all triangles, which is built at the first use."""
        if not self._parts:
            points = self.points
            self._parts.append(_part([(points[a], points[b], points[c]) for a, b, c in self.triangles]))
        return self._parts[0]


class _Part(NamedTuple):
    """A node of the bounding-box tree of a mesh: some triangles, and the box around them.

    Attributes:
        low, high: two opposite corners of the box.
        inner: the two halves of the triangles; empty in a leaf.
        corners: in a leaf, the three corners of each triangle; else empty.
    """

    low: Vector
    high: Vector
    inner: tuple[_Part, ...]
    corners: tuple[Corners, ...]

    def reached(self, origin: Vector, direction: Vector, nearest_m: float) -> bool:
        """Return whether a ray enters the box within `nearest_m` meters of its origin."""
        enter, leave = 0.0, nearest_m
        for at, way, low, high in zip(origin, direction, self.low, self.high, strict=True):
            if -_PARALLEL < way < _PARALLEL:
                if not low - _PARALLEL <= at <= high + _PARALLEL:
                    return False
                continue
            first, second = (low - at) / way, (high - at) / way
            enter, leave = max(enter, min(first, second)), min(leave, max(first, second))
        return enter <= leave + _SLACK_M


def _part(corners: list[Corners]) -> _Part:
    """Return the bounding-box tree of triangles; each box is divided along its longest side."""
    points = [point for three in corners for point in three]
    middle, size = box_of(points)
    low, high = (
        tuple(at + sign * length / 2.0 for at, length in zip(middle, size, strict=True))
        for sign in (-1.0, 1.0)
    )
    box = (low[0], low[1], low[2]), (high[0], high[1], high[2])
    if len(corners) <= _FEW_TRIANGLES:
        return _Part(*box, (), tuple(corners))
    axis = max(range(3), key=lambda it: size[it])
    ordered = sorted(corners, key=lambda three: three[0][axis] + three[1][axis] + three[2][axis])
    half = len(ordered) // 2
    return _Part(*box, (_part(ordered[:half]), _part(ordered[half:])), ())


def cone(radius_m: float, height_m: float) -> Mesh:
    """Return a cone around the z axis, with its middle at the origin and its tip above."""
    turns = [2.0 * math.pi * side / _SIDES for side in range(_SIDES)]
    rim = [(radius_m * math.cos(turn), radius_m * math.sin(turn), -height_m / 2.0) for turn in turns]
    bottom, tip = _SIDES, _SIDES + 1
    sides = [(side, (side + 1) % _SIDES) for side in range(_SIDES)]
    triangles = [*((a, b, tip) for a, b in sides), *((b, a, bottom) for a, b in sides)]
    return Mesh((*rim, (0.0, 0.0, -height_m / 2.0), (0.0, 0.0, height_m / 2.0)), tuple(triangles))


def face_set(node: SceneNode) -> Mesh | None:
    """Return the mesh of an IndexedFaceSet; None if it has no face. Faces with wrong indices are skipped."""
    flat = [number for coordinate in node.nodes("coord") for number in coordinate.numbers("point") or ()]
    if len(flat) % CORNERS or not are_lengths(flat):
        return None
    points = tuple(zip(flat[0::3], flat[1::3], flat[2::3], strict=True))
    faces = _faces(node.numbers("coordIndex") or (), len(points))
    mesh = Mesh(points, tuple(triangle for face in faces for triangle in cut(points, face)))
    if not mesh.triangles:
        return None
    return mesh if node.flag("ccw", True) else mesh.turned


def elevation_grid(node: SceneNode) -> Mesh | None:
    """Return the mesh of an ElevationGrid; None if it has too few heights for its dimensions."""
    columns, rows = (int((node.numbers(name) or (0.0,))[0]) for name in ("xDimension", "yDimension"))
    across, along = ((node.numbers(name) or (1.0,))[0] for name in ("xSpacing", "ySpacing"))
    heights = node.numbers("height") or ()
    complete = min(columns, rows) > 1 and len(heights) >= columns * rows
    if not complete or not are_lengths((*heights, across, along)):
        return None
    points = tuple(
        (column * across, row * along, heights[row * columns + column])
        for row in range(rows)
        for column in range(columns)
    )
    corners = (row * columns + column for row in range(rows - 1) for column in range(columns - 1))
    cells = ((at, at + 1, at + columns + 1, at + columns) for at in corners)
    return Mesh(points, tuple(triangle for cell in cells for triangle in _fan(cell)))


def are_lengths(numbers: Iterable[float]) -> bool:
    """Return whether all numbers are finite and at most `MOST_M`, in both directions."""
    return all(math.isfinite(number) and abs(number) <= MOST_M for number in numbers)


def cut(points: Sequence[Vector], face: Sequence[int]) -> list[Triangle]:
    """Return the triangles of a flat face, whose outline may be concave."""
    if len(face) <= _FEW:
        return list(_fan(face))
    flat = _flattened([points[index] for index in face])
    left, found = list(range(len(face))), []
    while len(left) > CORNERS:
        ear = next((at for at in range(len(left)) if _is_ear(flat, left, at)), None)
        if ear is None:  # the outline crosses itself
            break
        found.append((left[ear - 1], left[ear], left[(ear + 1) % len(left)]))
        del left[ear]
    found += _fan(left)
    return [(face[a], face[b], face[c]) for a, b, c in found]


def nearest_triangle(mesh: Mesh, origin: Vector, direction: Vector, *, front: bool = False) -> float:
    """Return the meters along a ray to the nearest triangle; infinite if the ray misses all triangles.

    With `front`, the ray passes through the triangles that it meets from behind.
    """
    least, nearest_m = _PARALLEL if front else -math.inf, math.inf
    waiting = [mesh.whole]
    while waiting:
        part = waiting.pop()
        if part.reached(origin, direction, nearest_m):
            waiting += part.inner
            for three in part.corners:
                nearest_m = min(nearest_m, _to_triangle(origin, direction, three, least))
    return nearest_m


def _to_triangle(origin: Vector, direction: Vector, corners: Corners, least: float) -> float:
    """Return the meters to a triangle, as in Möller and Trumbore (1997).

    `volume` is negative if the ray meets the triangle from behind.
    """
    a, b, c = corners
    first, second, apart = minus(b, a), minus(c, a), minus(origin, a)
    across = cross(direction, second)
    volume = dot(first, across)
    if abs(volume) < _PARALLEL or volume < least:
        return math.inf
    u = dot(apart, across) / volume
    turned = cross(apart, first)
    v = dot(direction, turned) / volume
    if u < 0.0 or v < 0.0 or u + v > 1.0:
        return math.inf
    distance = dot(second, turned) / volume
    return distance if distance >= 0.0 else math.inf


def placed(mesh: Mesh, scale: Vector) -> Mesh | None:
    """Return a scaled mesh with only the points of its triangles; a flat mesh becomes 1 mm thick.

    The result is None if every triangle has the area 0.
    """
    used = sorted({index for triangle in mesh.triangles for index in triangle})
    at = {index: place for place, index in enumerate(used)}
    x, y, z = scale
    points = [(px * x, py * y, pz * z) for px, py, pz in (mesh.points[index] for index in used)]
    triangles = [(at[a], at[b], at[c]) for a, b, c in mesh.triangles]
    largest = max((_area(points, triangle) for triangle in triangles), key=lambda it: math.hypot(*it))
    if math.hypot(*largest) < _PARALLEL:
        return None
    normal = _normal(points, largest)
    if normal is None:
        return Mesh(tuple(points), tuple(triangles))
    half = _SHEET_M / 2.0
    sides = [
        [(px + side * normal[0], py + side * normal[1], pz + side * normal[2]) for px, py, pz in points]
        for side in (half, -half)
    ]
    count = len(points)
    backs = [(a + count, c + count, b + count) for a, b, c in triangles]
    return Mesh((*sides[0], *sides[1]), (*triangles, *backs))


def _normal(points: Sequence[Vector], largest: Vector) -> Vector | None:
    """Return the unit vector along `largest` if it is the normal of a plane through all points, else None."""
    length = math.hypot(*largest)
    normal = largest[0] / length, largest[1] / length, largest[2] / length
    heights = [dot(normal, point) for point in points]
    return normal if max(heights) - min(heights) < _THIN_M else None


def _area(points: Sequence[Vector], triangle: Triangle) -> Vector:
    """Return a normal of a triangle; its length is twice the area of the triangle."""
    a, b, c = (points[index] for index in triangle)
    return cross(minus(b, a), minus(c, a))


def box_of(points: Sequence[Vector]) -> tuple[Vector, Vector]:
    """Return the middle and the size of the box around points."""
    low = [min(point[axis] for point in points) for axis in range(3)]
    high = [max(point[axis] for point in points) for axis in range(3)]
    x, y, z = ((below + above) / 2.0 for below, above in zip(low, high, strict=True))
    across, along, up = (above - below for below, above in zip(low, high, strict=True))
    return (x, y, z), (across, along, up)


def volume_m3(mesh: Mesh) -> float:
    """Return the volume that the triangles enclose; it is wrong if the mesh has gaps."""
    points = mesh.points
    return abs(sum(dot(points[a], cross(points[b], points[c])) for a, b, c in mesh.triangles)) / 6.0


def middle_of_volume(mesh: Mesh) -> Vector:
    """Return the center of the volume that the triangles enclose; the origin if they enclose no volume."""
    points = mesh.points
    corners = [(points[a], points[b], points[c]) for a, b, c in mesh.triangles]
    volumes = [dot(a, cross(b, c)) for a, b, c in corners]  # six times those of tetrahedra with the origin
    middles = [
        ((a[0] + b[0] + c[0]) / 4.0, (a[1] + b[1] + c[1]) / 4.0, (a[2] + b[2] + c[2]) / 4.0)
        for a, b, c in corners
    ]
    return weighted_mean(middles, volumes) or (0.0, 0.0, 0.0)


def _flattened(corners: Sequence[Vector]) -> list[tuple[float, float]]:
    """Return an outline without the coordinate along which it is thinnest, counterclockwise."""
    normal = [
        sum(
            a[(axis + 1) % 3] * b[(axis + 2) % 3] - a[(axis + 2) % 3] * b[(axis + 1) % 3]
            for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)
        )
        for axis in range(3)
    ]
    axis = max(range(3), key=lambda it: abs(normal[it]))
    first, second = ((axis + 1) % 3, (axis + 2) % 3)[:: 1 if normal[axis] > 0.0 else -1]
    return [(corner[first], corner[second]) for corner in corners]


def _is_ear(flat: Sequence[tuple[float, float]], left: Sequence[int], at: int) -> bool:
    """Return whether the remaining corner `at` can be cut off: no other corner is inside its triangle."""
    a, b, c = flat[left[at - 1]], flat[left[at]], flat[left[(at + 1) % len(left)]]
    if _turn(a, b, c) <= 0.0:
        return False
    others = (flat[index] for index in left)
    return not any(
        it not in (a, b, c) and min(_turn(a, b, it), _turn(b, c, it), _turn(c, a, it)) >= 0.0 for it in others
    )


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    """Return twice the area of a triangle; positive if it is counterclockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _faces(indices: Sequence[float], count: int) -> Iterator[list[int]]:
    """Yield the corners of each face; the index -1 ends a face."""
    face: list[int] = []
    for number in (*indices, -1.0):
        if number != -1.0:
            face.append(int(number))
            continue
        if len(face) >= CORNERS and all(0 <= index < count for index in face):
            yield face
        face = []


def _fan(face: Sequence[int]) -> Iterator[Triangle]:
    """Yield the triangles of a convex face."""
    for second, third in pairwise(face[1:]):
        yield face[0], second, third
