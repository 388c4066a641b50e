"""The shapes of obstacles: exact if they stand along the axes of their object, else the smallest box."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_protocol.obstacle_shapes import PartFrame, heading_of, tilt_of

LENGTHS = st.floats(0.1, 3.0)
VECTORS = st.tuples(*[st.floats(-2.0, 2.0)] * 3)
SIZES = st.tuples(LENGTHS, LENGTHS, LENGTHS)
ONE = (1.0, 1.0, 1.0)
ROUND = np.linspace(0.0, 2.0 * math.pi, 720, endpoint=False)


@st.composite
def turns(draw):
    """Return a unit quaternion."""
    axis = np.array(draw(VECTORS.filter(lambda axis: math.hypot(*axis) > 0.1)))
    half_rad = draw(st.floats(-math.pi, math.pi)) / 2.0
    x, y, z = math.sin(half_rad) * axis / np.linalg.norm(axis)
    return (float(x), float(y), float(z), math.cos(half_rad))


def turned(turn, points):
    """Return points (n, 3) after a rotation, by the product of quaternions."""
    axis, w = np.array(turn[:3]), turn[3]
    return points + 2.0 * np.cross(axis, np.cross(axis, points) + w * points)


def extent(points):
    """Return the middle and half the size of the smallest box around points."""
    low, high = points.min(axis=0), points.max(axis=0)
    return (low + high) / 2.0, (high - low) / 2.0


@given(VECTORS, turns(), SIZES, VECTORS, turns(), SIZES)
def test_a_box_in_nested_frames_has_the_smallest_box_around_its_corners(at, turn, scale, inner, again, size):
    """Each frame scales, then turns, then moves its contents."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * 0.5
    points = turned(again, corners * size) + inner
    middle, half = extent(turned(turn, points * scale) + at)

    found = PartFrame().inside(at, turn, scale).inside(inner, again, ONE).box(size)

    assert found.center == pytest.approx(middle, abs=1e-9)
    assert found.half == pytest.approx(half, abs=1e-9)
    assert found.radius_m == 0.0


@given(turns(), LENGTHS, LENGTHS)
def test_a_round_shape_covers_its_surface(turn, radius_m, height_m):
    """A cylinder that lies or leans has no upright outline, so its box counts."""
    rim = radius_m * np.stack((np.cos(ROUND), np.sin(ROUND), np.zeros(len(ROUND))), axis=1)
    up = np.array([0.0, 0.0, 0.5 * height_m])
    _, half = extent(turned(turn, np.concatenate((rim - up, rim + up))))
    ends = turned(turn, np.array([-up, up]))
    frame = PartFrame().inside((0.0, 0.0, 0.0), turn, ONE)
    cylinder, capsule = frame.cylinder(radius_m, height_m), frame.capsule(radius_m, height_m)

    for found, wanted in ((cylinder, half), (capsule, np.abs(ends).max(axis=0) + radius_m)):
        covered = (*(each + found.radius_m for each in found.half[:2]), found.half[2])
        assert covered == pytest.approx(tuple(wanted), rel=1e-4)
    assert frame.sphere(radius_m).half == pytest.approx((0.0, 0.0, radius_m))
    assert frame.sphere(radius_m).radius_m == pytest.approx(radius_m)


@given(VECTORS, turns(), SIZES, st.lists(VECTORS, min_size=1, max_size=9))
def test_a_set_of_faces_has_the_smallest_box_around_its_points(at, turn, scale, points):
    """A task must not put a robot inside an object of faces, and a larger box would take free places."""
    middle, half = extent(turned(turn, np.array(points) * scale) + at)

    found = PartFrame().inside(at, turn, scale).around(points)

    assert found.center == pytest.approx(middle, abs=1e-9)
    assert found.half == pytest.approx(half, abs=1e-9)


@given(SIZES, LENGTHS, LENGTHS)
def test_an_upright_round_shape_keeps_its_radius(scale, radius_m, height_m):
    """A scale that makes it an ellipse gives it the larger radius, so that it covers the ellipse."""
    found = PartFrame().inside((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), scale).cylinder(radius_m, height_m)

    assert found.half == (0.0, 0.0, pytest.approx(0.5 * height_m * scale[2]))
    assert found.radius_m == pytest.approx(radius_m * max(scale[:2]))


@given(turns(), VECTORS)
def test_heading_and_tilt_together_are_the_orientation(turn, point):
    """The heading changes while an object moves; the tilt is read once."""
    half_rad = heading_of(turn) / 2.0
    tilted = np.array(tilt_of(turn, ONE).rows) @ point

    found = turned((0.0, 0.0, math.sin(half_rad), math.cos(half_rad)), tilted)

    assert found == pytest.approx(turned(turn, np.array(point)), abs=1e-6)


def test_a_shape_along_the_axes_has_exact_numbers():
    """The copies of a batch and the single simulation must draw the same places, bit for bit."""
    frame = tilt_of((0.0, 0.0, math.sin(0.25), math.cos(0.25)), ONE)

    assert frame.box((0.1, 0.3, 0.7)) == ((0.0, 0.0, 0.0), (0.05, 0.15, 0.35), 0.0)
    assert frame.capsule(0.1, 0.7) == ((0.0, 0.0, 0.0), (0.0, 0.0, 0.35 + 0.1), 0.1)
