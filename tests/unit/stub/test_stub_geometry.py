"""Poses: composition, rotation, and the quaternions that clients read."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_sim.scene.geometry import (
    Pose,
    axis_angle_to_quaternion,
    from_axis_angle,
    multiply,
    to_quaternion,
    transposed,
    turn,
)

numbers = st.floats(-10, 10)
vectors = st.tuples(numbers, numbers, numbers)
axes = vectors.filter(lambda v: math.hypot(*v) > 0.1)
rotations = st.builds(lambda axis, angle: (*axis, angle), axes, st.floats(-7, 7))
matrices = rotations.map(from_axis_angle)
poses = st.builds(Pose, vectors, matrices)


def close(values, tolerance=1e-9):
    """Return a value that compares equal to these numbers up to rounding."""
    return pytest.approx(values, abs=tolerance)


@given(matrix=matrices, vector=vectors)
def test_a_rotation_keeps_lengths(matrix, vector):
    """A matrix that keeps lengths is a rotation or a reflection, so wrong entries are noticed."""
    assert math.hypot(*turn(matrix, vector)) == close(math.hypot(*vector))


@given(matrix=matrices, vector=vectors)
def test_the_transposed_turns_back(matrix, vector):
    """The transpose of a rotation is its inverse, so the code need not compute an inverse."""
    assert turn(transposed(matrix), turn(matrix, vector)) == close(vector)


@given(first=matrices, second=matrices, vector=vectors)
def test_a_product_does_the_second_rotation_first(first, second, vector):
    """The pose of a node in nested frames is a product in this order."""
    assert turn(multiply(first, second), vector) == close(turn(first, turn(second, vector)))


@given(outer=poses, inner=poses, point=vectors)
def test_a_frame_in_a_frame_carries_points_through_both(outer, inner, point):
    """A Pose inside a Pose moves points in this way."""
    assert outer.after(inner).carry(point) == close(outer.carry(inner.carry(point)), 1e-8)


@given(rotation=rotations)
def test_the_axis_stays_where_it_is(rotation):
    """If the axis moved, `from_axis_angle` would turn about another axis than that of the world file."""
    axis = rotation[:3]

    assert turn(from_axis_angle(rotation), axis) == close(axis)


@given(rotation=rotations)
def test_both_ways_to_a_quaternion_agree(rotation):
    """One quaternion comes from a field's axis and angle, the other from a node's matrix.

    A quaternion and its negative are the same rotation.
    """
    length = math.hypot(*rotation[:3])
    unit = (rotation[0] / length, rotation[1] / length, rotation[2] / length, rotation[3])
    direct = axis_angle_to_quaternion(unit)
    by_matrix = to_quaternion(from_axis_angle(rotation))

    dot = abs(sum(a * b for a, b in zip(direct, by_matrix, strict=True)))

    assert dot == close(1.0, 1e-7)
    assert by_matrix[3] >= 0.0


def test_an_axis_without_direction_turns_nothing():
    """An axis in a world file may be 0 0 0, and the rotation must not become NaN."""
    assert from_axis_angle((0.0, 0.0, 0.0, 1.0)) == from_axis_angle((0.0, 0.0, 1.0, 0.0))


@given(angle=st.floats(-3.1, 3.1))
def test_the_heading_is_the_angle_about_z(angle):
    """The planar physics turns a robot only about z, so the robot stays upright."""
    pose = Pose(rotation=from_axis_angle((0.0, 0.0, 1.0, angle)))

    assert pose.heading_rad == close(angle)
    assert pose.upright


def test_what_leans_by_more_than_two_degrees_is_not_upright():
    """The planar physics of the stub cannot simulate such a body."""
    assert not Pose(rotation=from_axis_angle((1.0, 0.0, 0.0, 0.036))).upright
    assert Pose(rotation=from_axis_angle((1.0, 0.0, 0.0, 0.034))).upright


def test_half_turns_have_quaternions_too():
    """At a half turn w is 0, and the usual formula divides by w."""
    for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)):
        quaternion = to_quaternion(from_axis_angle((*axis, math.pi)))

        assert [abs(q) for q in quaternion] == close([*axis, 0.0])
