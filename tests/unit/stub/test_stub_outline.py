"""The outline of a robot: discs in place of a box."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_sim.stub.outline import RoundPart, discs_of_box

sizes = st.floats(0.01, 3.0)
places = st.floats(-2.0, 2.0)


def ahead(box, heading_rad):
    """Return the reach of a box's discs from the origin in one direction."""
    c, s = math.cos(heading_rad), math.sin(heading_rad)
    return max(x * c + y * s + radius for x, y, radius in box)


def test_a_square_is_one_disc():
    """The disc has the width of the square, so the corners are cut off."""
    assert discs_of_box(0.5, -0.2, 0.3, 0.4, 0.4) == (RoundPart(0.5, -0.2, 0.2),)


def test_a_box_is_a_row_of_discs_along_its_longer_axis():
    """For a robot of 0.6 x 0.2 m, the discs are at -0.2 to 0.2 m, one radius apart."""
    discs = discs_of_box(0.0, 0.0, 0.0, 0.6, 0.2)

    assert [disc.x_m for disc in discs] == pytest.approx([-0.2, -0.1, 0.0, 0.1, 0.2])
    assert all(disc[1:] == (0.0, 0.1) for disc in discs)


def test_a_box_wider_than_long_is_a_row_to_its_side():
    """A world file may describe the same box with swapped sides and another heading."""
    wide = discs_of_box(1.0, 2.0, 0.2, 0.2, 0.6)
    long = discs_of_box(1.0, 2.0, 0.2 + math.pi / 2, 0.6, 0.2)

    assert wide == long


@given(x=places, y=places, heading=st.floats(-4, 4), length=sizes, width=sizes)
def test_the_discs_have_the_length_and_width_of_the_box(x, y, heading, length, width):
    """The robot must stop at a wall as the box would."""
    discs = discs_of_box(x, y, heading, length, width)

    for direction, half in ((0.0, length / 2), (math.pi / 2, width / 2)):
        for angle in (heading + direction, heading + direction + math.pi):
            center = x * math.cos(angle) + y * math.sin(angle)
            assert ahead(discs, angle) - center == pytest.approx(half, abs=1e-9)


@given(length=sizes, width=sizes)
def test_the_sides_are_closed_unless_the_box_is_a_bar(length, width):
    """Up to a length of eight widths, neighbor discs overlap by half; a longer box has sixteen discs."""
    discs = discs_of_box(0.0, 0.0, 0.0, length, width)
    count = len(discs)

    assert count <= 16
    if count not in (1, 16):
        gap = math.dist(discs[0][:2], discs[1][:2])
        assert gap <= discs[0].radius_m + 1e-9


def test_a_box_without_width_has_discs_without_radius():
    """A box with a width of 0 is a mistake in a world, which must not crash the simulator."""
    assert {disc.radius_m for disc in discs_of_box(0.0, 0.0, 0.0, 1.0, 0.0)} == {0.0}
