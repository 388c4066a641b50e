"""Shapes as world files describe them, each with a formula for the distance of a ray.

Each shape has rays for the test: a start, and a point on the ray, in meters in the frame of the shape. The
rays meet sides, ends, edges and round parts, or miss the shape narrowly.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from tests.values import rays

Points = tuple[tuple[tuple[float, float, float], tuple[float, float, float]], ...]

# An L: 2 m along x and 2 m along y, 0.5 m thick and 1 m high.
_OUTLINE = [(0.0, 0.0), (2.0, 0.0), (2.0, 0.5), (0.5, 0.5), (0.5, 2.0), (0.0, 2.0)]
_CORNERS = [(x, y, z) for z in (-0.5, 0.5) for x, y in _OUTLINE]
_ROOF = [(0, 1, 2, 3), (0, 3, 4, 5)]  # two convex faces that together fill the outline
_SIDES = [(side, (side + 1) % 6, (side + 1) % 6 + 6, side + 6) for side in range(6)]
_FACES = [*(face[::-1] for face in _ROOF), *(tuple(at + 6 for at in face) for face in _ROOF), *_SIDES]
_TRIANGLES = [
    [_CORNERS[face[0]], _CORNERS[face[second]], _CORNERS[face[second + 1]]]
    for face in _FACES
    for second in (1, 2)
]
_POINTS = ", ".join("{:g} {:g} {:g}".format(*corner) for corner in _CORNERS)
_INDICES = ", ".join(f"{' '.join(map(str, face))} -1" for face in _FACES)
ELL = f"IndexedFaceSet {{ coord Coordinate {{ point [ {_POINTS} ] }} coordIndex [ {_INDICES} ] }}"
_OBJ = [
    *("v {:g} {:g} {:g}".format(*corner) for corner in _CORNERS),
    *(f"f {' '.join(str(at + 1) for at in face)}" for face in _FACES),
]
FILES = {"ell.obj": "\n".join(_OBJ).encode()}  # the mesh files that nodes name, by their addresses
# Where the spine points along z, Webots rotates the cross-section by half a turn. Clockwise sections face
# out.
_SECTION = ", ".join(f"{-x:g} {-y:g}" for x, y in [*reversed(_OUTLINE), _OUTLINE[-1]])
EXTRUSION = f"Extrusion {{ crossSection [ {_SECTION} ] spine [ 0 0 -0.5, 0 0 0.5 ] }}"
# Rays toward the L: the start of each ray, and a point on the ray.
_TOWARD_ELL: Points = (
    ((3.0, 0.2, 0.1), (0.0, 0.2, 0.1)),
    ((3.0, 1.2, 0.1), (0.0, 1.2, 0.1)),
    ((1.2, 1.2, 2.0), (1.2, 1.2, 0.0)),
    ((1.4, 1.6, 0.2), (1.0, 0.2, 0.0)),
    ((0.2, 1.0, 2.0), (0.3, 1.2, 0.0)),
)
SHEET = """IndexedFaceSet { coord Coordinate { point [ 0 -1 -1, 0 1 -1, 0 1 1, 0 -1 1 ] }
  coordIndex [ 0 1 2 3 -1 ] }"""
_SHEET = [[(0, -1, -1), (0, 1, -1), (0, 1, 1)], [(0, -1, -1), (0, 1, 1), (0, -1, 1)]]  # the sheet faces +x
_HEIGHTS = np.array([[0.0, 0.0, 0.0], [0.0, 0.5, 0.0], [0.2, 0.5, 0.2]])  # indexed [y, x]; points 1 m apart
_CELLS = [
    [[x + dx, y + dy, _HEIGHTS[y + dy, x + dx]] for dx, dy in corners]
    for x in (0, 1)
    for y in (0, 1)
    for corners in (((0, 0), (1, 0), (1, 1)), ((0, 0), (1, 1), (0, 1)))
]


@dataclass(frozen=True)
class Shape:
    """A geometry.

    Attributes:
        type: the type of the node.
        node: the text of the node.
        formula: returns meters for a ray's origin and unit direction, (3,) each in the frame of the shape.
        aims: the rays, as start and target.
        tolerance: absolute tolerance in meters.
        bounding: whether a boundingObject may contain the geometry.
        seen: the formula for the visible surface, if it differs.
        volume_m3: the volume, or None if the surface is open.
        name: distinguishes shapes of the same type in the names of tests.
    """

    type: str
    node: str
    formula: Callable
    aims: Points
    tolerance: float = 1e-5
    bounding: bool = True
    seen: Callable | None = None
    volume_m3: float | None = None
    name: str = ""

    def __str__(self):
        """Return the name, or the type without one, for the name of a test."""
        return self.name or self.type


SHAPES = (
    Shape(
        "Box",
        "Box { size 1 0.6 0.8 }",
        partial(rays.box, size=(1.0, 0.6, 0.8)),
        (
            ((2.0, 0.1, 0.2), (0.0, 0.1, 0.2)),
            ((-2.0, 1.5, 0.1), (0.4, 0.1, -0.2)),
            ((0.3, -0.2, 2.0), (0.1, 0.1, 0.0)),
            ((2.0, 2.0, 1.4), (0.45, 0.25, 0.35)),
            ((2.0, -1.0, 0.38), (-0.45, -0.1, 0.38)),
            ((2.0, 0.0, 0.5), (0.0, 0.0, 0.5)),
        ),
        volume_m3=1.0 * 0.6 * 0.8,
    ),
    Shape(
        "Sphere",
        "Sphere { radius 0.5 }",
        partial(rays.sphere, radius=0.5),
        (
            ((2.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
            ((2.0, 0.2, 0.3), (0.0, 0.2, 0.3)),
            ((-1.0, 1.5, 1.2), (0.1, 0.0, 0.2)),
            ((0.1, 0.2, -2.0), (0.1, 0.2, 0.0)),
            ((1.0, 0.0, 0.48), (-1.0, 0.0, 0.48)),
            ((1.0, 0.4, 0.4), (-1.0, 0.4, 0.4)),
        ),
        volume_m3=4.0 / 3.0 * np.pi * 0.5**3,
    ),
    Shape(
        "Cylinder",
        "Cylinder { radius 0.5 height 0.8 }",
        partial(rays.cylinder, radius=0.5, height=0.8),
        (
            ((2.0, 0.0, 0.1), (0.0, 0.0, 0.1)),
            ((2.0, 0.3, -0.2), (0.0, 0.3, -0.2)),
            ((-1.0, 1.5, 1.2), (0.1, 0.0, 0.2)),
            ((0.1, 0.2, 2.0), (0.3, 0.1, 0.0)),
            ((0.3, 0.0, -2.0), (-0.1, 0.1, 0.0)),
            ((2.0, 0.45, 0.39), (-2.0, 0.45, 0.39)),
            ((2.0, 0.45, 0.41), (-2.0, 0.45, 0.41)),
        ),
        volume_m3=np.pi * 0.5**2 * 0.8,
    ),
    Shape(
        "Capsule",
        "Capsule { radius 0.3 height 0.8 }",
        partial(rays.capsule, radius=0.3, height=0.8),
        (
            ((2.0, 0.1, 0.1), (0.0, 0.1, 0.1)),
            ((2.0, 0.0, 0.55), (0.0, 0.0, 0.55)),
            ((2.0, 0.1, -0.6), (0.0, 0.1, -0.6)),
            ((0.1, 0.1, 2.0), (0.1, 0.1, 0.0)),
            ((1.0, 1.0, 1.5), (0.0, 0.1, 0.5)),
            ((2.0, 0.25, 0.6), (-2.0, 0.25, 0.6)),
        ),
        volume_m3=np.pi * 0.3**2 * 0.8 + 4.0 / 3.0 * np.pi * 0.3**3,
    ),
    Shape(
        "Plane",
        "Plane { size 20 20 }",
        rays.plane,
        (
            ((1.0, 1.0, 2.0), (0.0, 0.5, 0.0)),
            ((0.0, 0.0, 0.3), (0.0, 0.0, 0.0)),
            ((-3.0, 2.0, 1.0), (2.0, -1.0, 0.0)),
            ((0.0, 0.0, 0.5), (1.0, 0.0, 0.5)),
            ((0.5, 0.3, -1.0), (0.6, 0.2, 0.0)),
        ),
        seen=rays.front_of_plane,
    ),
    Shape(
        "IndexedFaceSet",
        ELL,
        partial(rays.triangles, corners=_TRIANGLES),
        (*_TOWARD_ELL, ((3.0, 2.5, 0.0), (1.0, 2.2, 0.0))),
        volume_m3=2.0 * 0.5 + 1.5 * 0.5,
    ),
    Shape(
        "IndexedFaceSet",
        EXTRUSION,
        partial(rays.triangles, corners=_TRIANGLES),
        _TOWARD_ELL,
        volume_m3=2.0 * 0.5 + 1.5 * 0.5,
        name="Extrusion",
    ),
    Shape(
        "Mesh",
        'Mesh { url "ell.obj" }',
        partial(rays.triangles, corners=_TRIANGLES),
        _TOWARD_ELL,
        volume_m3=2.0 * 0.5 + 1.5 * 0.5,
    ),
    Shape(
        "IndexedFaceSet",
        SHEET,
        partial(rays.triangles, corners=_SHEET),
        (
            ((2.0, 0.3, 0.1), (0.0, 0.2, 0.4)),
            ((-2.0, 0.3, 0.1), (0.0, 0.2, 0.4)),
            ((1.0, 1.5, 0.0), (0.0, -0.5, 0.3)),
            ((1.0, 0.0, 1.5), (0.0, 0.0, 1.2)),
        ),
        tolerance=2e-3,  # the sheet is a millimeter thick
        seen=partial(rays.front_of_triangles, corners=_SHEET),
        name="sheet",
    ),
    Shape(
        "Cone",
        "Cone { bottomRadius 0.5 height 1 }",
        partial(rays.cone, radius=0.5, height=1.0),
        (
            ((2.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
            ((2.0, 0.1, -0.3), (0.0, 0.1, -0.3)),
            ((0.1, 0.1, -2.0), (0.1, 0.1, 0.0)),
            ((-1.0, 1.5, 1.2), (0.1, 0.0, -0.2)),
        ),
        tolerance=0.02,  # Webots draws a cone with 32 sides
        bounding=False,
    ),
    Shape(
        "ElevationGrid",
        f"ElevationGrid {{ xDimension 3 yDimension 3 height [ {' '.join(map(str, _HEIGHTS.ravel()))} ] }}",
        partial(rays.triangles, corners=_CELLS),
        (
            ((0.7, 0.6, 2.0), (0.8, 0.7, 0.0)),
            ((3.0, 1.5, 0.6), (0.5, 1.0, 0.1)),
            ((1.6, 1.7, 1.0), (1.5, 1.4, 0.0)),
            ((0.7, 0.6, -2.0), (0.8, 0.7, 0.0)),
        ),
        bounding=False,
        seen=partial(rays.front_of_triangles, corners=_CELLS),
    ),
)
