"""Observations: the frames, units and bounds of their numbers."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_trainer.environments.observation import PARTS, StepState, observe, space, velocity
from palaestra_trainer.robots import Pose

SITUATION = StepState(
    distances_m=np.full(9, 0.4, np.float32),
    bumped=False,
    pose=Pose(1.0, 0.0, math.pi / 2),
    velocity=(0.5, 0.0, 0.0),
    target=(1.0, 1.0),
    time_left=0.75,
)

angles = st.floats(-math.pi, math.pi, exclude_min=True)
meters = st.floats(-2.0, 2.0)
poses = st.builds(Pose, meters, meters, angles)


def numbers(part: str, **changes) -> list[float]:
    """Return the numbers of one part of the observation, for a situation with some changes."""
    return observe(replace(SITUATION, **changes), [part], space([part])).tolist()


def test_the_target_is_seen_from_the_robot():
    """For a robot that looks along y, a target at y = 1 m is ahead, and a target at x = 0 is on its left."""
    assert SITUATION.target_ahead == pytest.approx((1.0, 0.0))
    assert replace(SITUATION, target=(0.0, 0.0)).target_ahead == pytest.approx((0.0, 1.0))


@given(pose=poses, target=st.tuples(meters, meters))
def test_the_distance_to_the_target_does_not_depend_on_where_the_robot_looks(pose, target):
    """A turn on the spot does not bring the robot nearer."""
    seen = replace(SITUATION, pose=pose, target=target)

    assert seen.target_distance_m == pytest.approx(math.dist((pose.x_m, pose.y_m), target), abs=1e-9)


def test_sensors_tell_how_near_things_are():
    """A value of 0 means no object in range, and 1 the nearest measurable distance.

    The last number is the bumper.
    """
    distances_m = np.array([0.03, 0.215, *[0.4] * 7], np.float32)

    seen = numbers("sensors", distances_m=distances_m, bumped=True)

    assert seen == pytest.approx([1.0, 0.5, *[0.0] * 7, 1.0], abs=1e-6)


def test_velocity_is_in_units_of_the_movements():
    """Driving FORWARD gives 1, and a turn to the right at full speed gives -1."""
    assert numbers("velocity", velocity=(0.5, -0.25, -1.0)) == pytest.approx([1.0, -0.5, -1.0])


def test_position_is_in_the_worlds_frame():
    """Half of the floor is 1. The heading is a point on the unit circle, so its values do not jump."""
    assert numbers("position") == pytest.approx([0.5, 0.0, 0.0, 1.0], abs=1e-6)


def test_time_left_counts_down():
    """The value goes from 1 at the start to 0 at the time limit."""
    assert numbers("time_left") == [0.75]


@pytest.mark.parametrize("part", PARTS)
def test_a_number_beyond_its_bound_is_cut_off(part):
    """If a simulator throws the robot across the world, the learner must not get huge numbers."""
    wild = observe(
        replace(SITUATION, pose=Pose(1e6, -1e6, 3.0), velocity=(1e6, -1e6, 1e6), time_left=-1.0),
        [part],
        space([part]),
    )

    assert space([part]).contains(wild)


@pytest.mark.parametrize("parts", list(itertools.combinations(PARTS, 2)), ids="-".join)
def test_parts_follow_each_other_in_the_order_they_are_named(parts):
    """The index in the data sheet then gives the position of a number in the observation."""
    seen = observe(SITUATION, parts, space(parts))

    assert seen.tolist() == [*numbers(parts[0]), *numbers(parts[1])]
    assert seen.dtype == np.float32


@given(before=poses, ahead=st.tuples(meters, meters))
def test_velocity_without_turning_is_the_way_over_the_time(before, ahead):
    """The value is the distance in the frame of the robot's old heading, divided by the elapsed seconds."""
    c, s = math.cos(before.heading_rad), math.sin(before.heading_rad)
    after = Pose(
        before.x_m + ahead[0] * c - ahead[1] * s,
        before.y_m + ahead[0] * s + ahead[1] * c,
        before.heading_rad,
    )

    assert velocity(before, after, 0.5) == pytest.approx((ahead[0] * 2, ahead[1] * 2, 0.0), abs=1e-9)


def test_turning_is_measured_the_short_way_around():
    """When the heading passes from pi to -pi, the robot has turned by a small angle."""
    _, _, turning = velocity(Pose(0, 0, math.pi - 0.1), Pose(0, 0, -math.pi + 0.1), 0.2)

    assert turning == pytest.approx(1.0)
