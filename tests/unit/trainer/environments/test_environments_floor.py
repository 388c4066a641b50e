"""The floor in a layout: its corners are those of its box in the world."""

import math

import pytest

from palaestra_protocol.obstacle_shapes import ObstacleShape
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.robots.simulated import layout_of
from palaestra_trainer.webots import FLOOR, Thing

BOX = ObstacleShape((0.5, 0.0, 0.0), (2.0, 1.0, 0.0), 0.0)
DISC = ObstacleShape((0.0, 0.0, 0.0), (0.0, 0.0, 0.1), 3.0)


def floor(heading_rad, *shapes):
    """Return the lowest and the highest corner of a floor at x = 10 with these shapes."""
    layout = layout_of([Thing(FLOOR, (10.0, 0.0, 0.0), heading_rad, shapes)])
    return layout.low, layout.high


@pytest.mark.parametrize(
    ("heading_rad", "low", "high"),
    [
        (0.0, (8.5, -1.0), (12.5, 1.0)),
        (0.5 * math.pi, (9.0, -1.5), (11.0, 2.5)),
        (-math.pi, (7.5, -1.0), (11.5, 1.0)),
    ],
)
def test_a_floor_may_be_turned_by_a_right_angle_and_its_box_may_be_off_center(heading_rad, low, high):
    """Starts and targets outside the floor have no support, and no policy can reach them."""
    found = floor(heading_rad, DISC, BOX)

    assert (*found[0], *found[1]) == pytest.approx((*low, *high))


def test_a_floor_whose_sides_are_not_along_the_axes_is_refused():
    """A layout has only two corners, so each of its rectangles would miss or exceed such a floor."""
    with pytest.raises(ConfigurationError, match=r"turned by 0\.500 rad about z, .* multiple of 90 degrees"):
        floor(0.5, BOX)


def test_a_round_floor_is_refused():
    """Its box would have corners without floor."""
    with pytest.raises(ConfigurationError, match="the floor is round; give its Solid a Box"):
        floor(0.0, DISC)
