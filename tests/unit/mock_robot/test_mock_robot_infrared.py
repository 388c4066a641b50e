"""The distance of an infra-red sensor, from its voltage."""

from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_sim.mock_robot.infrared import OUT_OF_RANGE_M, distance_m
from palaestra_sim.scene.lookup_table import LookupTable

SHARP = ((0.03, 3.03, 0.005), (0.1, 1.25, 0.005), (0.2, 0.66, 0.005), (0.3, 0.42, 0.005), (0.4, 0.31, 0.005))
RISING = ((0.0, 0.0, 0.0), (0.2, 100.0, 0.0))
PEAK = ((0.0, 0.0, 0.0), (0.04, 3.0, 0.0), (0.3, 0.4, 0.0))


def without_noise(mean, _deviation):
    """Return the mean, as a sensor without noise does."""
    return mean


@given(st.floats(0.03, 0.39))
def test_it_inverts_the_table(true_m):
    """The distance follows from the lookup table in the world file, so the mock robot needs no formula."""
    value = LookupTable(SHARP).response(true_m, without_noise)

    assert distance_m(SHARP, value) == pytest.approx(true_m, abs=1e-9)


def test_a_sensor_that_sees_nothing_reports_0_41():
    """A real Robotino reports exactly 0.41 m then, so the noise of the sensor must not change this value."""
    gauss = Random(0).gauss
    values = [LookupTable(SHARP).response(2.0, gauss) for _ in range(1000)]

    assert {distance_m(SHARP, value) for value in values} == {OUT_OF_RANGE_M}


def test_a_surface_that_is_too_close_has_the_least_distance():
    """With noise, the voltage may be above every voltage in the lookup table."""
    assert distance_m(SHARP, 3.1) == 0.03


def test_a_table_may_rise():
    """The voltage of Sharp's sensors falls with the distance, but a world may have other sensors."""
    assert distance_m(RISING, 50.0) == pytest.approx(0.1)
    assert distance_m(RISING, 100.0) == OUT_OF_RANGE_M


def test_of_two_distances_the_farther_one_is_reported():
    """Below 4 cm, the voltage of a real sensor falls again, so the robot takes the wall for a farther one."""
    assert distance_m(PEAK, 1.7) == pytest.approx(0.17)


def test_no_distance_is_longer_than_out_of_range():
    """A world may have sensors with a longer range than the robot."""
    assert distance_m(((0.0, 10.0, 0.0), (2.0, 0.0, 0.0)), 5.0) == OUT_OF_RANGE_M
