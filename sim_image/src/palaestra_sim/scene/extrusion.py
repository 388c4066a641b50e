"""The faces of an Extrusion: a cross-section that is moved along a spine. Pure.

Webots converts an Extrusion to an IndexedFaceSet by a PROTO with a template; this module computes the same
faces. Webots converts a bent spine with a `splineSubdivision` to a curve; this module computes no such curve.
Source: Extrusion.proto of Webots R2023b, and ISO/IEC 14772-1, 6.18.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from palaestra_sim.scene.geometry import Vector, cross, dot, from_axis_angle, minus, turn

_DEFAULTS: Final = {
    "crossSection": (1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0, 1.0, 1.0, 1.0),
    "spine": (0.0, 0.0, 0.0, 0.0, 0.0, 1.0),
    "scale": (1.0, 1.0),
    "orientation": (0.0, 0.0, 1.0, 0.0),
    "splineSubdivision": (4.0,),
}
# Maximum number of points of a spine or a cross-section. The time to divide a face into triangles grows with
# the square of this number.
_MOST: Final = 1000
_STRAIGHT: Final = 1e-9
_LEAST_SPINE: Final = 2
_LEAST_SECTION: Final = 4  # minimum number of points of a cross-section; the last repeats the first
_TURN: Final = 4  # a rotation has this many numbers
_PAIR: Final = 2


@dataclass(frozen=True, slots=True)
class Faces:
    """The points and the `coordIndex` of an IndexedFaceSet."""

    points: tuple[Vector, ...]
    index: tuple[int, ...]


def faces(fields: Mapping[str, Sequence[float]], *, begin_cap: bool, end_cap: bool) -> Faces | None:
    """Return the faces of an Extrusion; None if its fields are incomplete, or if it is curved."""
    values = {name: tuple(fields.get(name) or default) for name, default in _DEFAULTS.items()}
    section = list(zip(values["crossSection"][0::2], values["crossSection"][1::2], strict=False))
    flat = values["spine"]
    spine = list(zip(flat[0::3], flat[1::3], flat[2::3], strict=False))
    numbers = (number for value in values.values() for number in value)
    sizes = _LEAST_SPINE <= len(spine) <= _MOST and _LEAST_SECTION <= len(section) <= _MOST
    if not (sizes and all(map(math.isfinite, numbers))):
        return None
    if values["splineSubdivision"][0] > 0.0:
        changes = len(values["scale"]) > _PAIR or len(values["orientation"]) > _TURN
        if changes or not _straight(spine):
            return None
        spine = [spine[0], spine[-1]]
    points = [
        point
        for at, (x, z) in enumerate(_axes(spine))
        for point in _placed(
            section, spine[at], (x, z), _at(values["scale"], at, _PAIR), _turn_at(values, at)
        )
    ]
    return Faces(tuple(points), tuple(_index(len(spine), len(section), begin_cap=begin_cap, end_cap=end_cap)))


def _placed(
    section: Sequence[tuple[float, float]],
    center: Vector,
    axes: tuple[Vector, Vector],
    scale: Sequence[float],
    rotation: Sequence[float] | None,
) -> list[Vector]:
    """Return the cross-section at a point of the spine."""
    x, z = axes
    found = []
    for across, along in section:
        a, b = across * scale[0], -along * scale[1]
        point = x[0] * a + z[0] * b, x[1] * a + z[1] * b, x[2] * a + z[2] * b
        if rotation is not None:
            point = turn(from_axis_angle((rotation[0], rotation[1], rotation[2], rotation[3])), point)
        found.append((point[0] + center[0], point[1] + center[1], point[2] + center[2]))
    return found


def _index(count: int, corners: int, *, begin_cap: bool, end_cap: bool) -> list[int]:
    """Return the faces: first cap, sides, last cap; the last corner, which repeats the first, is left out."""
    index: list[int] = []
    if begin_cap:
        index += [*range(corners - 1), -1]
    for j in range(corners - 1):
        for i in range(count - 1):
            low, high = j + i * corners, j + (i + 1) * corners
            index += [low, high, high + 1, low + 1, -1]
    if end_cap:
        index += [*(count * corners - j - 1 for j in range(corners - 1)), -1]
    return index


def _axes(spine: Sequence[Vector]) -> list[tuple[Vector, Vector]]:
    """Return x and z of the plane of the cross-section at each point of the spine."""
    last = len(spine) - 1
    closed = spine[0] == spine[last]
    found: list[tuple[Vector, Vector]] = []
    z = (0.0, 0.0, 0.0)
    for i, here in enumerate(spine):
        end = i in (0, last)
        if end and closed:
            y = minus(spine[1], spine[last - 1])
            fresh = cross(minus(spine[1], here), minus(spine[last - 1], here))
        elif i == 0:
            y = minus(spine[1], here)
            fresh = _first_z(spine, y)
        elif i == last:
            y = minus(here, spine[last - 1])
            fresh = z
        else:
            y = minus(spine[i + 1], spine[i - 1])
            fresh = cross(minus(spine[i + 1], here), minus(spine[i - 1], here))
        if fresh == (0.0, 0.0, 0.0):
            fresh = z
        if i and dot(fresh, z) < 0.0:
            fresh = -fresh[0], -fresh[1], -fresh[2]
        z = fresh
        found.append((_unit(cross(y, z)), _unit(z)))
    return found


def _first_z(spine: Sequence[Vector], y: Vector) -> Vector:
    """Return z at the start of an open spine: the z of its first bend.

    Without a bend, return the z axis, rotated by the rotation from the y axis to `y`.
    """
    bends = (
        cross(minus(spine[k + 1], spine[k]), minus(spine[k - 1], spine[k])) for k in range(1, len(spine) - 1)
    )
    z = next((bend for bend in bends if bend != (0.0, 0.0, 0.0)), None)
    if z is None:
        z = (0.0, 0.0, 1.0)
        axis = cross((0.0, 1.0, 0.0), y)
        if axis != (0.0, 0.0, 0.0):
            angle = math.acos(max(-1.0, min(1.0, y[1] / math.hypot(*y))))
            z = turn(from_axis_angle((*_unit(axis), angle)), z)
    return (-z[0], -z[1], -z[2]) if max(z) > 0.0 else z


def _straight(spine: Sequence[Vector]) -> bool:
    """Return whether all points are on one line, in the order of their distances from the first point."""
    whole = minus(spine[-1], spine[0])
    length = math.hypot(*whole)
    parts = [minus(after, before) for before, after in pairwise(spine)]
    apart = (math.hypot(*cross(part, whole)) for part in parts)
    return length > 0.0 and all(dot(part, whole) >= 0.0 for part in parts) and max(apart) < _STRAIGHT


def _at(values: Sequence[float], place: int, count: int) -> Sequence[float]:
    """Return the numbers of one point of the spine; the last numbers apply to all further points."""
    place = min(place, len(values) // count - 1)
    return values[place * count : (place + 1) * count]


def _turn_at(values: Mapping[str, Sequence[float]], place: int) -> Sequence[float] | None:
    """Return the rotation at a point of the spine; None if it is missing, as in Webots."""
    found = values["orientation"][place * _TURN : (place + 1) * _TURN]
    return found if len(found) == _TURN and any(found[:3]) else None


def _unit(vector: Vector) -> Vector:
    length = math.hypot(*vector) or 1.0
    return vector[0] / length, vector[1] / length, vector[2] / length
