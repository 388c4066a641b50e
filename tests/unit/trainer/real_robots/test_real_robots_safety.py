"""The rules that decide whether a real robot may move."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.real_robots.safety import (
    STANDING,
    Fence,
    SafetyRules,
    Situation,
    decide,
    is_finite,
    is_motion,
    limited,
)
from palaestra_trainer.robots.geometry import Pose

RULES = SafetyRules(fence=Fence((-2.0, -2.0), (2.0, 2.0)))
FORWARD = (0.5, 0.0, 0.0)
DRIVING = Situation(
    command=FORWARD,
    silent_s=0.01,
    permitted=True,
    readings_age_s=0.05,
    unconfirmed_s=0.05,
    asleep_s=0.05,
    bumped=False,
    pose=Pose(0.0, 0.0, 0.0),
    velocity=(0.2, 0.0, 0.0),
    driven_m=1.0,
    rested_s=0.0,
    pushing_s=0.0,
)
# Each row: what differs from DRIVING, the cause, and whether the robot stays stopped.
CAUSES = [
    ({"bumped": True}, "bumper", True),
    ({"readings_age_s": 2.1}, "connection lost", True),
    ({"readings_age_s": math.inf}, "connection lost", True),
    ({"unconfirmed_s": 2.1, "readings_age_s": 1.9}, "connection lost", True),
    ({"pose": Pose(1.75, 0.0, 0.0)}, "fence", True),
    ({"pose": Pose(0.0, -3.0, 0.0)}, "fence", True),
    ({"rested_s": 1.1}, "another client", True),
    ({"unconfirmed_s": 2.1}, "commands refused", True),
    ({"asleep_s": 2.1}, "suspended", True),
    ({"pushing_s": 1.1}, "no effect", True),
    ({"permitted": False}, "released", False),
    ({"readings_age_s": 0.31}, "stale readings", False),
    ({"silent_s": 0.21}, "silent policy", False),
]


def test_the_command_of_the_policy_is_sent_within_the_limits():
    """No rule forbids this motion, but the command is faster than the limit of 0.2 m/s."""
    assert decide(DRIVING, RULES) == ((0.2, 0.0, 0.0), None)


def test_a_robot_without_a_command_stands():
    """Before the first action of a policy nothing may move."""
    assert decide(replace(DRIVING, command=None), RULES).twist == STANDING


@pytest.mark.parametrize(("differs", "name", "stops"), CAUSES)
def test_each_cause_holds_the_robot(differs, name, stops):
    """If a cause can end by itself, the drive continues after it; after any other cause, a person decides."""
    twist, cause = decide(replace(DRIVING, **differs), RULES)

    assert twist == STANDING
    assert (cause.name, cause.stops) == (name, stops)


def test_the_first_cause_is_the_most_important_one():
    """A person who has released the key must see that the robot has hit something."""
    bumped = replace(DRIVING, bumped=True, permitted=False, readings_age_s=9.0)

    assert decide(bumped, RULES).cause.name == "bumper"


def test_the_fence_is_closer_after_a_long_way():
    """Odometry drifts, so after 10 m the true position may be half a meter from the measured one."""
    at = replace(DRIVING, pose=Pose(1.4, 0.0, 0.0))

    assert decide(at, RULES).cause is None
    assert decide(replace(at, driven_m=10.0), RULES).cause.name == "fence"


def test_the_fence_is_closer_for_old_readings_and_fast_commands():
    """While a reading is old, the robot drives on, at the speed that was commanded."""
    at = replace(DRIVING, pose=Pose(1.68, 0.0, 0.0), driven_m=0.0, velocity=(0.0, 0.0, 0.0))

    assert decide(at, RULES).cause is None
    assert decide(replace(at, readings_age_s=0.29), RULES).cause.name == "fence"
    assert decide(at, replace(RULES, speed_m_s=0.5)).cause.name == "fence"


@pytest.mark.parametrize(
    ("twist", "moves"), [((0.06, 0.0, 0.0), True), ((0.03, 0.03, 0.0), False), ((0.0, 0.0, -0.2), True)]
)
def test_a_command_below_the_least_speed_of_a_robotino_is_no_motion(twist, moves):
    """Near its target, a policy may command too low a speed for the motors; the robot then rightly stands."""
    assert is_motion(twist) is moves


def test_without_a_fence_the_robot_may_go_anywhere():
    """A program that has its own fence passes none."""
    assert decide(replace(DRIVING, pose=Pose(99.0, 0.0, 0.0)), SafetyRules()).cause is None


@given(
    twist=st.tuples(*[st.floats(-9.0, 9.0)] * 3),
    speed=st.floats(0.01, 2.0),
    turn=st.floats(0.01, 2.0),
)
def test_no_command_exceeds_the_limits_or_changes_its_direction(twist, speed, turn):
    """A slower robot must drive the same way, or it would hit what the policy avoids."""
    forward, left, turning = limited(twist, SafetyRules(speed_m_s=speed, turn_rad_s=turn))

    assert math.hypot(forward, left) <= speed * (1.0 + 1e-9)
    assert abs(turning) <= turn
    assert forward * twist[1] == pytest.approx(left * twist[0])
    assert forward * twist[0] >= 0.0
    assert turning * twist[2] >= 0.0


@given(twist=st.tuples(*[st.floats(-0.1, 0.1)] * 3))
def test_a_command_within_the_limits_is_sent_as_it_is(twist):
    """A slow policy needs no correction."""
    assert limited(twist, SafetyRules()) == pytest.approx(twist)


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
def test_a_velocity_that_is_not_finite_is_recognized(wrong):
    """A diverged policy returns NaN, which no comparison with a limit finds."""
    assert is_finite(FORWARD)
    assert not is_finite((0.0, wrong, 0.0))


@pytest.mark.parametrize("corners", [((0.0, 0.0), (0.4, 2.0)), ((1.0, 1.0), (-1.0, -1.0))])
def test_a_fence_without_a_place_for_the_robot_is_refused(corners):
    """Corners in the wrong order are the usual mistake."""
    with pytest.raises(ConfigurationError, match=r"has no place for a robot of 0\.46 m; give the smallest"):
        Fence(*corners)
