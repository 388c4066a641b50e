"""Meshes: the first triangle on a ray, and meshes that are flat or empty."""

import random

import numpy as np
import pytest

from palaestra_sim.scene.meshes import Mesh, nearest_triangle
from tests.tables import for_each
from tests.values import rays
from tests.values.worlds import PHYSICS, Setting


@pytest.mark.parametrize("front", [False, True])
def test_the_nearest_of_many_triangles_is_that_of_all(front):
    """A ray tests only the triangles in boxes that it meets, and must still find the nearest one."""
    draw = random.Random(5)
    points = [tuple(draw.uniform(-1.0, 1.0) for _ in range(3)) for _ in range(60)]
    triangles = [tuple(draw.sample(range(60), 3)) for _ in range(200)]
    mesh = Mesh(tuple(points), tuple(triangles))
    corners = np.array([[points[index] for index in triangle] for triangle in triangles])
    formula = rays.front_of_triangles if front else rays.triangles
    for _ in range(50):
        start, target = (np.array([draw.uniform(-2.0, 2.0) for _ in range(3)]) for _ in range(2))
        ahead = (target - start) / np.linalg.norm(target - start)
        met = nearest_triangle(mesh, tuple(start), tuple(ahead), front=front)
        assert met == pytest.approx(formula(start, ahead, corners))


def test_a_ray_along_a_side_of_a_mesh_is_met_by_the_others():
    """The box of a flat mesh has no height, and the ray's direction across the box is exactly 0.

    This must not cause a division by 0.
    """
    sheet = Mesh(((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0)), ((0, 1, 2),))

    assert nearest_triangle(sheet, (0.9, 0.1, 2.0), (0.0, 0.0, -1.0)) == pytest.approx(2.0)
    assert nearest_triangle(sheet, (-1.0, 0.1, 0.0), (1.0, 0.0, 0.0)) == float("inf")


MESHES = [
    "point [ 0 0 0, 0 0 0, 0 0 0 ] } coordIndex [ 0 1 2 -1 ]",
    "point [ 0 0 0, 1 0 0, 2 0 0 ] } coordIndex [ 0 1 2 -1 ]",
    "point [ 0 0 0, 1 0 0, 0 1 1 ] } coordIndex [ 0 1 2 -1 ]",
    "point [ 0 0 0, 1 0 0, 1 1 0.00015, 0 1 0 ] } coordIndex [ 0 1 2 3 -1 ]",
    "point [ 0 0 0, 1 0 0, 1 1 0, 0 1 0 ] } coordIndex [ ]",
]


@pytest.mark.parametrize("physics", PHYSICS)
@for_each("mesh", MESHES)
def test_a_mesh_without_a_volume_is_an_obstacle_too(mesh, physics):
    """MuJoCo would reject the convex hull of such a mesh, with a message that names no node of the world."""
    outline = f"IndexedFaceSet {{ coord Coordinate {{ {mesh} }}"
    simulation = Setting(physics).load(f"Solid {{ boundingObject {outline} }}")

    simulation.step(16)

    assert len(simulation.scene.solids) == 1
