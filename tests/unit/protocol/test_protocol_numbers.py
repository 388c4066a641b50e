"""Numbers that people type as options: the accepted numbers, and the message about all others."""

import math
from argparse import ArgumentTypeError

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_protocol.numbers import milliseconds, seconds, whole


@given(st.integers(), st.integers(-5, 5), st.none() | st.integers(5, 10))
def test_a_whole_number_is_taken_if_and_only_if_it_is_within_its_bounds(number, least, most):
    """Each option has a least value, and some have a largest value; another number is a typing error."""
    within = least <= number and (most is None or number <= most)
    try:
        assert whole(least, most)(str(number)) == number
    except ArgumentTypeError:
        assert not within
    else:
        assert within


@given(st.floats())
def test_times_are_finite_and_only_a_delay_may_be_nothing(number):
    """An endless or a negative time is a typing error; only a delay may be 0."""
    for read, allowed in ((seconds, number > 0.0), (milliseconds, number >= 0.0)):
        try:
            assert read(repr(number)) == number
        except ArgumentTypeError:
            assert not (allowed and math.isfinite(number))
        else:
            assert allowed
            assert math.isfinite(number)


@pytest.mark.parametrize("text", ["", "many", "1e999999x", "0x10"])
def test_what_is_no_number_is_said_to_be_none(text):
    """The message quotes the typed text, so that a person finds the mistake."""
    for read in (whole(), seconds, milliseconds):
        with pytest.raises(ArgumentTypeError, match=f"^{text!r} is not a "):
            read(text)
