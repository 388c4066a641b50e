"""The contents of messages follow the conventions of ROS."""

import json
import math

import pytest

from palaestra_trainer.bags import messages
from palaestra_trainer.errors import ConfigurationError


def test_nine_ranges_are_a_scan_from_the_front_counterclockwise():
    """A reader of a LaserScan computes each direction from the first angle and the step."""
    scan = messages.ranges(2.5, [0.1] * 9, (0.03, 0.4))

    assert (scan["angle_min"], math.degrees(scan["angle_increment"])) == (0.0, pytest.approx(40.0))
    assert math.degrees(scan["angle_max"]) == pytest.approx(320.0)
    assert (scan["range_min"], scan["range_max"], len(scan["ranges"])) == (0.03, 0.4, 9)
    assert scan["header"] == {"stamp": {"sec": 2, "nanosec": 500_000_000}, "frame_id": "base_link"}


def test_a_distance_out_of_range_is_infinite():
    """The sensor then returns the bound of its range. A reader would take it for an obstacle (REP 117)."""
    scan = messages.ranges(0.0, [0.4, 0.5, 0.03, 0.2, math.nan], (0.03, 0.4))

    assert scan["ranges"][:4] == [math.inf, math.inf, -math.inf, 0.2]
    assert math.isnan(scan["ranges"][4])


@pytest.mark.parametrize("heading", [0.0, 1.0, -2.0, math.pi])
def test_a_heading_is_a_turn_around_the_vertical_axis(heading):
    """ROS has quaternions, and their sign decides between left and right."""
    content = messages.odometry(1.0, (1.0, -2.0, heading), (0.5, 0.1, -1.0))

    pose = content["pose"]["pose"]
    turned = pose["orientation"]
    assert math.atan2(2 * turned["w"] * turned["z"], 1 - 2 * turned["z"] ** 2) == pytest.approx(heading)
    assert pose["position"] == {"x": 1.0, "y": -2.0, "z": 0.0}
    assert content["twist"]["twist"] == messages.twist((0.5, 0.1, -1.0))
    assert (content["header"]["frame_id"], content["child_frame_id"]) == ("odom", "base_link")


def test_a_velocity_that_was_not_measured_is_marked():
    """A velocity of 0 would be a wrong claim about a robot that moves."""
    unknown = messages.odometry(1.0, (0.0, 0.0, 0.0), None)
    at_rest = messages.odometry(1.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))

    assert unknown["twist"]["covariance"] == [-1.0, *[0.0] * 35]
    assert at_rest["twist"]["covariance"] == [0.0] * 36


@pytest.mark.parametrize("stamp_s", [-0.1, math.nan, math.inf, 2.0**31])
def test_a_time_that_ros_2_cannot_count_is_refused(stamp_s):
    """The bag would have a wrong time, and a player would wait for years."""
    with pytest.raises(ConfigurationError, match="is not a time of ROS 2; give 0 to 2147483647 s"):
        messages.nanoseconds(stamp_s)


def test_a_time_just_before_the_last_second_is_still_one():
    """Rounding must not overflow the 31 bits of the seconds, and a time of today must keep all its digits."""
    assert messages.nanoseconds(1_790_000_000.25) == 1_790_000_000_250_000_000
    assert messages.nanoseconds(math.nextafter(2.0**31, 0.0)) < 2**31 * 10**9


def test_a_record_is_json_that_every_reader_accepts():
    """JSON has no NaN, so strict readers refuse a text with it."""
    content = messages.record({"decision": "stop", "reason": 'no "odom" for 1 s'})

    assert json.loads(content["data"]) == {"decision": "stop", "reason": 'no "odom" for 1 s'}
    with pytest.raises(ValueError, match="not JSON compliant"):
        messages.record({"speed": math.nan})
