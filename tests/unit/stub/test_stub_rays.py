"""A sensor's lookup table converts meters to volts; a robot has a fan of rays."""

import math
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_sim.scene.lookup_table import LookupTable
from palaestra_sim.stub.obstacles import Disc, Neighborhood
from palaestra_sim.stub.rays import Fan

ROWS = [(0.1, 3.0, 0.0), (0.2, 2.0, 0.0), (0.4, 1.0, 0.0)]


def silent(_mean, _deviation):
    """Raise an error: a sensor without noise must not draw a random number."""
    raise AssertionError("a sensor without noise drew some")


def one(_mean, deviation):
    """Return a random number of exactly one standard deviation."""
    return deviation


def test_rows_answer_their_own_value():
    """A row is a measured pair of distance and voltage, so its distance must give exactly its voltage."""
    table = LookupTable(ROWS)

    assert [table.response(row[0], silent) for row in ROWS] == pytest.approx([3.0, 2.0, 1.0])


@pytest.mark.parametrize(("distance", "volts"), [(0.15, 2.5), (0.3, 1.5), (0.25, 1.75)])
def test_between_rows_it_is_linear(distance, volts):
    """As in Webots, the values between two rows are interpolated."""
    assert LookupTable(ROWS).response(distance, silent) == pytest.approx(volts)


@pytest.mark.parametrize(("distance", "volts"), [(0.0, 3.0), (0.05, 3.0), (0.41, 1.0), (1e9, 1.0)])
def test_beyond_both_ends_the_end_value_holds(distance, volts):
    """As in Webots, the table does not extrapolate at either end."""
    assert LookupTable(ROWS).response(distance, silent) == volts


def test_noise_is_a_fraction_of_the_response():
    """A noise of 10 % means a standard deviation of 0.2 V at 2 V."""
    table = LookupTable([(d, v, 0.1) for d, v, _ in ROWS])

    assert table.response(0.2, one) == pytest.approx(2.2)
    assert table.response(0.0, one) == pytest.approx(3.3)
    assert table.response(9.0, one) == pytest.approx(1.1)


def test_noise_is_interpolated_too():
    """Each row of the table has its own noise."""
    table = LookupTable([(0.0, 1.0, 0.0), (1.0, 1.0, 0.2)])

    assert table.response(0.5, one) == pytest.approx(1.1)


def test_an_empty_table_answers_metres():
    """As in Webots, a sensor without a table returns the distance in meters."""
    assert LookupTable([]).response(0.37, silent) == pytest.approx(0.37)


@given(distance=st.floats(0, 2))
def test_a_response_lies_between_the_limits(distance):
    """A message has `min_range` and `max_range`, which hold for values without noise."""
    table = LookupTable(ROWS)
    low, high = table.limits

    assert low <= table.response(distance, silent) <= high


def test_noise_has_the_spread_that_the_table_says():
    """Over many draws, the standard deviation is 0.5 % of the value."""
    table = LookupTable([(0.0, 2.0, 0.005)])
    gauss = random.Random(1).gauss
    draws = [table.response(0.1, gauss) for _ in range(5000)]
    mean = sum(draws) / len(draws)
    deviation = math.sqrt(sum((draw - mean) ** 2 for draw in draws) / len(draws))

    assert mean == pytest.approx(2.0, abs=0.001)
    assert deviation == pytest.approx(0.01, rel=0.05)


def fan_of(obstacles):
    """Return two rays on the rim of a robot: one ahead and one to the left."""
    fan = Fan([(0.2, 0.0, 1.0, 0.0), (0.0, 0.2, 0.0, 1.0)], [0.4, 0.4])
    fan.face(Neighborhood(obstacles, fan.reach_m), ())
    return fan


def test_rays_that_meet_nothing_have_their_full_reach():
    """The table converts the full length to the value of its last row."""
    assert fan_of([]).cast((0.0, 0.0, 1.0, 0.0)) == [0.4, 0.4]


def test_each_ray_is_stopped_for_itself():
    """Only an obstacle in its own direction shortens a ray."""
    assert fan_of([Disc(0.0, 0.5, 0.1)]).cast((0.0, 0.0, 1.0, 0.0)) == pytest.approx([0.4, 0.2])


def test_rays_turn_with_the_robot():
    """After a left turn, objects that were on the left are ahead."""
    left = math.pi / 2

    distances = fan_of([Disc(0.0, 0.5, 0.1)]).cast((0.0, 0.0, math.cos(left), math.sin(left)))

    assert distances == pytest.approx([0.2, 0.4])


def test_rays_meet_robots_that_drive():
    """The rays meet a robot at its current position, not at that of the world file."""
    other = Disc(5.0, 0.0, 0.2)
    fan = Fan([(0.2, 0.0, 1.0, 0.0)], [0.4])
    fan.face(Neighborhood((), fan.reach_m), [other])
    assert fan.cast((0.0, 0.0, 1.0, 0.0)) == [0.4]

    other.x = 0.7

    assert fan.cast((0.0, 0.0, 1.0, 0.0)) == pytest.approx([0.3])
