"""The Wilson interval of a success rate."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_trainer.episodes.wilson import wilson


@st.composite
def shares(draw):
    """Draw a number of successes and of episodes."""
    episodes = draw(st.integers(1, 10_000))
    return draw(st.integers(0, episodes)), episodes


@pytest.mark.parametrize(
    ("successes", "episodes", "low", "high"),
    [(0, 10, 0.0, 0.2775), (10, 10, 0.7225, 1.0), (15, 20, 0.5313, 0.8881), (95, 100, 0.8882, 0.9785)],
)
def test_bounds_are_those_of_the_literature(successes, episodes, low, high):
    """The values are those of binom.test and prop.test(correct=FALSE) in R, by Wilson's method."""
    interval = wilson(successes, episodes)

    assert (interval.low, interval.high) == pytest.approx((low, high), abs=1e-4)


@given(shares())
def test_the_interval_is_a_part_of_all_rates_and_holds_the_share(share):
    """A rounded share may be equal to a bound."""
    successes, episodes = share

    interval = wilson(successes, episodes)

    assert 0.0 <= interval.low <= round(successes / episodes, 4) <= interval.high <= 1.0
    assert interval.low < interval.high


@given(shares())
def test_more_episodes_say_more(share):
    """A person who plays more episodes with the same share of successes must get a narrower interval."""
    successes, episodes = share

    few, many = wilson(successes, episodes), wilson(4 * successes, 4 * episodes)

    assert many.high - many.low < few.high - few.low


@pytest.mark.parametrize(("successes", "episodes"), [(0, 0), (3, 2), (-1, 2)])
def test_what_is_no_share_is_refused(successes, episodes):
    """Without the error, a caller would divide by zero or take the root of a negative number."""
    with pytest.raises(ValueError, match="not a share"):
        wilson(successes, episodes)
