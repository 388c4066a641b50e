"""The odometry of the mock robot: its own frame, its integration, and its drift."""

import math
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_sim.mock_robot.odometry import DriftingOdometry

STEP_S = 0.032
speeds = st.floats(-1.0, 1.0)


def driven(odometry, velocity, seconds):
    """Return x, y and heading before and after a motion."""
    before = odometry.reading[:3]
    for _ in range(round(seconds / STEP_S)):
        odometry.advance(velocity, STEP_S)
    return before, odometry.reading[:3]


def local(before, after):
    """Return the motion from one pose to another: ahead, to the left, and turned."""
    dx, dy = after[0] - before[0], after[1] - before[1]
    c, s = math.cos(before[2]), math.sin(before[2])
    return dx * c + dy * s, dy * c - dx * s, math.remainder(after[2] - before[2], math.tau)


def test_it_starts_anywhere():
    """A program that takes the odometry for the position in the room must fail in the mock already."""
    starts = {DriftingOdometry(0.0, Random(seed)).reading[:3] for seed in range(20)}

    assert len(starts) == 20
    assert max(math.hypot(x, y) for x, y, _ in starts) > 1.0


def test_the_same_seed_gives_the_same_odometry():
    """A failed trial must be repeatable."""
    one, other = DriftingOdometry(0.02, Random(7)), DriftingOdometry(0.02, Random(7))

    assert driven(one, (0.3, 0.1, 0.5), 2.0) == driven(other, (0.3, 0.1, 0.5), 2.0)


@given(speeds, speeds, speeds)
def test_without_drift_it_integrates_the_motion(vx, vy, omega):
    """Constant speeds draw an arc, whose end has a closed form."""
    odometry = DriftingOdometry(0.0, Random(1))
    before, after = driven(odometry, (vx, vy, omega), 0.32)
    turned = omega * 0.32
    straight = math.sin(turned / 2.0) / (turned / 2.0) if turned else 1.0
    c, s = math.cos(turned / 2.0), math.sin(turned / 2.0)
    ahead, aside = 0.32 * straight * (vx * c - vy * s), 0.32 * straight * (vx * s + vy * c)

    assert local(before, after) == pytest.approx((ahead, aside, turned), abs=1e-4)
    assert -math.pi <= after[2] <= math.pi


@pytest.mark.parametrize("seed", range(8))
def test_drift_changes_the_length_of_a_way(seed):
    """The odometry of a real robot has this error too, because wheels wear and floors differ."""
    odometry = DriftingOdometry(0.02, Random(seed))
    before, after = driven(odometry, (0.5, 0.0, 0.0), 0.32)

    length = math.hypot(after[0] - before[0], after[1] - before[1])
    assert abs(length / 0.16 - 1.0) == pytest.approx(0.02, rel=0.01)


@pytest.mark.parametrize("seed", range(8))
def test_drift_changes_a_turned_angle(seed):
    """The error of the heading grows with each turn."""
    before, after = driven(DriftingOdometry(0.02, Random(seed)), (0.0, 0.0, 1.0), 0.96)

    assert abs(local(before, after)[2] / 0.96 - 1.0) == pytest.approx(0.02)


@pytest.mark.parametrize("seed", range(8))
def test_drift_turns_the_heading_on_a_straight_way(seed):
    """Without a turn, the heading must become wrong too, or long straight ways would have no error."""
    before, after = driven(DriftingOdometry(0.02, Random(seed)), (0.5, 0.0, 0.0), 1.92)

    assert abs(local(before, after)[2]) == pytest.approx(0.01 * 0.96)


def test_a_robot_at_rest_does_not_drift():
    """The errors come from wheels that turn."""
    before, after = driven(DriftingOdometry(0.02, Random(0)), (0.0, 0.0, 0.0), 3.2)

    assert before == after


def test_the_sequence_number_counts_the_updates():
    """Clients detect a new reading by its last value, the sequence number. The velocity comes before it."""
    odometry = DriftingOdometry(0.0, Random(0))
    odometry.advance((0.1, 0.2, 0.3), STEP_S)
    odometry.advance((0.1, 0.2, 0.4), STEP_S)

    assert odometry.reading[3:] == (0.1, 0.2, 0.4, 2)
