"""The responses of a Robotino's REST interface as readings."""

import json
import math

import numpy as np
import pytest

from palaestra_trainer.errors import ConfigurationError, LinkError
from palaestra_trainer.real_robots.rest_answers import bumped_of, charges, distances_of, odometry_of
from palaestra_trainer.real_robots.sensor_layout import SensorLayout
from palaestra_trainer.robots.geometry import Pose

NINE = [0.05, 0.06, 0.07, 0.08, 0.09, 0.10, 0.11, 0.12, 0.41]
LAYOUT = SensorLayout()


def body(content):
    """Return content as a response has it."""
    return json.dumps(content).encode()


def test_odometry_has_pose_and_velocity():
    """The documented order is x, y, rotation, vx, vy, omega, number; a rotation may exceed a turn."""
    number, found = odometry_of(body([1.0, -2.0, 3.5 * math.pi, 0.1, 0.2, 0.3, 17]))

    assert number == 17
    assert found.pose == Pose(1.0, -2.0, pytest.approx(-0.5 * math.pi))
    assert found.velocity == (0.1, 0.2, 0.3)


def test_distances_are_clipped_to_the_range_of_the_sensors():
    """A robot reports 0.41 m where nothing is in range; the policy learned with 0.40 m."""
    found = distances_of(body(NINE), LAYOUT)

    assert found.dtype == np.float32
    assert found == pytest.approx([*NINE[:8], 0.40])


def test_clockwise_sensors_are_turned_around():
    """One public project found that its robot numbers the sensors clockwise."""
    found = distances_of(body(NINE), SensorLayout(order="clockwise"))

    assert found == pytest.approx([0.05, 0.40, *NINE[7:0:-1]])


def test_volts_become_meters():
    """A robot whose driver passes the voltages of a GP2Y0A41 reports 1.0 V at 0.13 m."""
    found = distances_of(body([1.0] * 9), SensorLayout(unit="volts"))

    assert found == pytest.approx([0.1594 - 0.02916] * 9)


@pytest.mark.parametrize("wrong", [{"order": "left"}, {"unit": "inches"}])
def test_an_unknown_layout_is_refused(wrong):
    """A wrong order would make the robot avoid the wrong side."""
    with pytest.raises(ConfigurationError, match=r"sensors: .* is not known; use .* or "):
        SensorLayout(**wrong)


@pytest.mark.parametrize("value", [True, False])
def test_the_bumper_is_a_bool(value):
    """The documented response is an object with one value."""
    assert bumped_of(body({"value": value})) is value


@pytest.mark.parametrize(("power", "charging"), [(True, True), (False, False), (1, True), (0, False)])
def test_external_power_counts_as_charging(power, charging):
    """Public clients read this field; whether it is a bool or a number is not documented."""
    assert charges(body({"ext_power": power, "voltage": 25.2})) is charging


@pytest.mark.parametrize(
    ("read", "wrong"),
    [
        (odometry_of, b""),
        (odometry_of, b"<html>"),
        (odometry_of, body([1, 2, 3])),
        (odometry_of, body([1, 2, 3, 4, 5, 6, None])),
        (odometry_of, b"[NaN,0,0,0,0,0,0]"),
        (odometry_of, body([True, 0, 0, 0, 0, 0, 0])),
        (odometry_of, body([10**400, 0, 0, 0, 0, 0, 0])),
        (odometry_of, body([0, 0, 0, 1.5e308, 1.5e308, 0, 0])),
        (odometry_of, b"[" * 60_000),
        (lambda text: distances_of(text, LAYOUT), body([0.1] * 8)),
        (lambda text: distances_of(text, LAYOUT), body({"value": 1})),
        (bumped_of, body({"value": 1})),
        (bumped_of, body([])),
        (charges, body({})),
    ],
)
def test_a_response_of_another_program_is_refused(read, wrong):
    """The address may be that of a router, whose page must not become a reading."""
    with pytest.raises(LinkError, match=r"/data/\w+: returned .*, which a Robotino does not"):
        read(wrong)
