"""Poses of odometry in the frame of a task."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_trainer.real_robots.frames import OdometryFrame, extrapolated, wrapped
from palaestra_trainer.robots.geometry import Pose

METERS = st.floats(-50.0, 50.0)
POSES = st.builds(Pose, METERS, METERS, st.floats(-math.pi, math.pi))


def near(one, other):
    """Return whether two poses are equal, except for rounding."""
    turned = wrapped(one.heading_rad - other.heading_rad)
    return math.dist((one.x_m, one.y_m), (other.x_m, other.y_m)) < 1e-9 and abs(turned) < 1e-9


@given(reported=POSES, known=POSES)
def test_the_pose_at_the_start_is_the_known_one(reported, known):
    """The person says where the robot stands, wherever its odometry began."""
    assert near(OdometryFrame.through(reported, known).of_task(reported), known)


@given(reported=POSES, known=POSES, forward=METERS, left=METERS)
def test_a_way_in_odometry_is_the_same_way_in_the_task(reported, known, forward, left):
    """A robot that drives a meter forward has driven a meter forward in every frame."""
    frame = OdometryFrame.through(reported, known)
    there = extrapolated(reported, (forward, left, 0.0), 1.0)

    assert near(frame.of_task(there), extrapolated(known, (forward, left, 0.0), 1.0))


@pytest.mark.parametrize(
    ("velocity", "pose"),
    [
        ((0.5, 0.0, 0.0), (1.0, 0.5, math.pi / 2.0)),
        ((0.0, 0.5, 0.0), (0.5, 0.0, math.pi / 2.0)),
        ((0.0, 0.0, math.pi), (1.0, 0.0, -math.pi / 2.0)),
    ],
)
def test_odometry_is_extrapolated_along_the_robots_own_axes(velocity, pose):
    """A robot that faces y drives forward along y, and to its left along minus x."""
    assert near(extrapolated(Pose(1.0, 0.0, math.pi / 2.0), velocity, 1.0), Pose(*pose))


@given(angle=st.floats(-100.0, 100.0))
def test_angles_are_in_the_interval_of_poses(angle):
    """The sum of two headings may be outside of (-pi, pi], the interval of `Pose.heading_rad`."""
    assert -math.pi < wrapped(angle) <= math.pi
    assert math.isclose(math.cos(wrapped(angle)), math.cos(angle), abs_tol=1e-9)
