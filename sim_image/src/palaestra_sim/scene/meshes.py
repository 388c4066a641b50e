"""Triangle meshes, from the points and faces in a world, or from a shape. Pure."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from palaestra_sim.scene.geometry import Vector
from palaestra_sim.scene.nodes.scene_node import SceneNode

_SIDES: Final = 20  # of a cone
_CORNERS: Final = 3  # of a triangle
_FEW: Final = 4  # a face with at most so many corners is treated as convex; most have three or four
_LARGEST_M: Final = 1e5

Triangle = tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class Mesh:
    """Triangles, counterclockwise as seen from outside; `points` in meters."""

    points: tuple[Vector, ...]
    triangles: tuple[Triangle, ...]


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
    if len(flat) % _CORNERS or not _finite(flat):
        return None
    points = tuple(zip(flat[0::3], flat[1::3], flat[2::3], strict=True))
    faces = _faces(node.numbers("coordIndex") or (), len(points))
    triangles = [triangle for face in faces for triangle in cut(points, face)]
    if not node.flag("ccw", True):
        triangles = [(a, c, b) for a, b, c in triangles]
    return Mesh(points, tuple(triangles)) if triangles else None


def elevation_grid(node: SceneNode) -> Mesh | None:
    """Return the mesh of an ElevationGrid; None if it has too few heights for its dimensions."""
    columns, rows = (int((node.numbers(name) or (0.0,))[0]) for name in ("xDimension", "yDimension"))
    across, along = ((node.numbers(name) or (1.0,))[0] for name in ("xSpacing", "ySpacing"))
    heights = node.numbers("height") or ()
    complete = min(columns, rows) > 1 and len(heights) >= columns * rows
    if not complete or not _finite((*heights, across, along)):
        return None
    points = tuple(
        (column * across, row * along, heights[row * columns + column])
        for row in range(rows)
        for column in range(columns)
    )
    corners = (row * columns + column for row in range(rows - 1) for column in range(columns - 1))
    cells = ((at, at + 1, at + columns + 1, at + columns) for at in corners)
    return Mesh(points, tuple(triangle for cell in cells for triangle in _fan(cell)))


def cut(points: Sequence[Vector], face: Sequence[int]) -> list[Triangle]:
    """Return the triangles of a flat face, whose outline may be concave."""
    if len(face) <= _FEW:
        return list(_fan(face))
    flat = _flattened([points[index] for index in face])
    left, found = list(range(len(face))), []
    while len(left) > _CORNERS:
        ear = next((at for at in range(len(left)) if _is_ear(flat, left, at)), None)
        if ear is None:  # the outline crosses itself
            break
        found.append((left[ear - 1], left[ear], left[(ear + 1) % len(left)]))
        del left[ear]
    found += _fan(left)
    return [(face[a], face[b], face[c]) for a, b, c in found]


def _flattened(corners: Sequence[Vector]) -> list[tuple[float, float]]:
    """Return an outline in the plane without its thinnest axis, counterclockwise."""
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
    """Return whether the remaining corner `at` can be cut off, because no other is inside its triangle."""
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
    """Yield the corners of each face; -1 ends one."""
    face: list[int] = []
    for number in (*indices, -1.0):
        if number != -1.0:
            face.append(int(number))
            continue
        if len(face) >= _CORNERS and all(0 <= index < count for index in face):
            yield face
        face = []


def _fan(face: Sequence[int]) -> Iterator[Triangle]:
    """Yield the triangles of a convex face."""
    for second, third in pairwise(face[1:]):
        yield face[0], second, third


def _finite(numbers: Sequence[float]) -> bool:
    return all(math.isfinite(number) and abs(number) <= _LARGEST_M for number in numbers)
