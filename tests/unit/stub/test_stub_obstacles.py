"""Discs, blocks and hulls push robots out and stop rays; the tests check both by the gap to the obstacle."""

import math

import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from palaestra_sim.stub.obstacles import Block, Disc, Hull, Neighborhood

places = st.floats(-3, 3)
nearby = st.floats(-1.5, 1.5)  # distance from the center of an obstacle, so that most robots touch it
angles = st.floats(-math.pi, math.pi)
sizes = st.floats(0.05, 2)
discs = st.builds(Disc, places, places, sizes)
blocks = st.builds(Block, places, places, angles, st.tuples(sizes, sizes))
angles_around = st.lists(st.integers(0, 11), min_size=3, max_size=6, unique=True)


@st.composite
def hulls(draw):
    """Draw the hull of some points on an ellipse, and of one point between them."""
    x, y, width, length = draw(places), draw(places), draw(sizes), draw(sizes)
    corners = [math.pi * index / 6.0 for index in draw(angles_around)]
    points = [(x + width * math.cos(turn), y + length * math.sin(turn)) for turn in corners]
    middle = tuple(sum(numbers) / len(points) for numbers in zip(*points, strict=True))
    return Hull([*points, middle])


obstacles = st.one_of(discs, blocks, hulls())
AHEAD = ((0.0, 0.0, 1.0, 0.0),)


def cast(obstacle, x, y, heading, reach=10.0):
    """Return the length of one ray that starts at x, y."""
    distances = [reach]
    obstacle.scan((x, y, math.cos(heading), math.sin(heading)), AHEAD, distances)
    return distances[0]


@given(
    place=st.tuples(places, places), away=st.tuples(nearby, nearby), heading=angles, radius=st.floats(0.05, 1)
)
# The square of this distance is so small that rounding destroys its digits.
@example(place=(0.0, 0.0), away=(0.0, 2.8e-161), heading=0.0, radius=1.0)
@pytest.mark.parametrize("block", [False, True], ids=["disc", "block"])
def test_a_robot_that_was_pushed_out_touches_and_is_not_inside(block, place, away, heading, radius):
    """A contact has the shortest way out of the obstacle. A robot that moves this way ends at the surface."""
    obstacle = Block(*place, heading, (1.0, 2.0)) if block else Disc(*place, 1.0)
    x, y = place[0] + away[0], place[1] + away[1]
    contact = obstacle.contact(x, y, radius)
    assume(contact is not None)
    nx, ny, depth = contact

    assert math.hypot(nx, ny) == pytest.approx(1.0)
    assert depth > 0.0
    assert obstacle.gap(x + nx * depth, y + ny * depth) == pytest.approx(radius, abs=1e-9)


@given(obstacle=obstacles, x=places, y=places, radius=st.floats(0.05, 1))
def test_there_is_a_contact_exactly_where_the_gap_is_smaller_than_the_radius(obstacle, x, y, radius):
    """The gap and the contact are computed separately, and must describe the same shape."""
    gap = obstacle.gap(x, y)
    assume(abs(gap - radius) > 1e-9)

    assert (obstacle.contact(x, y, radius) is not None) == (gap < radius)


@given(obstacle=obstacles, x=places, y=places, heading=angles)
def test_a_ray_ends_at_the_surface_and_crosses_nothing_before(obstacle, x, y, heading):
    """A sensor must measure the first surface, so no point before it may be inside the obstacle."""
    assume(obstacle.gap(x, y) > 1e-6)
    met = cast(obstacle, x, y, heading)
    end = (x + met * math.cos(heading), y + met * math.sin(heading))

    if met < 10.0:
        assert obstacle.gap(*end) == pytest.approx(0.0, abs=1e-6)
    for i in range(50):
        way = met * i / 50
        assert obstacle.gap(x + way * math.cos(heading), y + way * math.sin(heading)) > -1e-9


@given(obstacle=obstacles, x=places, y=places)
def test_a_ray_towards_the_middle_meets_the_shape(obstacle, x, y):
    """The middle is inside the shape, so such a ray cannot miss the shape."""
    assume(obstacle.gap(x, y) > 1e-6)

    met = cast(obstacle, x, y, math.atan2(obstacle.y - y, obstacle.x - x))

    assert met < 10.0


@given(obstacle=obstacles, x=places, y=places)
def test_a_ray_away_from_the_shape_does_not_turn_round(obstacle, x, y):
    """A sensor does not see an obstacle behind it."""
    assume(obstacle.gap(x, y) > 1e-3)

    assert cast(obstacle, x, y, math.atan2(y - obstacle.y, x - obstacle.x)) == 10.0


@given(x=places, y=places, heading=angles, ray_heading=angles)
def test_turning_robot_and_ray_is_turning_the_ray(x, y, heading, ray_heading):
    """A ray is given in the frame of the robot, so the headings of robot and ray add up."""
    block = Block(0.3, -0.2, 0.7, (1.0, 0.5))
    assume(block.gap(x, y) > 1e-3)
    distances = [10.0]
    ray = (0.0, 0.0, math.cos(ray_heading), math.sin(ray_heading))
    block.scan((x, y, math.cos(heading), math.sin(heading)), (ray,), distances)

    assert distances[0] == pytest.approx(cast(block, x, y, heading + ray_heading), abs=1e-6)


def test_a_ray_begins_at_its_own_origin():
    """Sensors are on the robot's rim, not at its center."""
    distances = [10.0]

    Disc(2.0, 0.0, 0.5).scan((0.0, 0.0, 1.0, 0.0), ((0.2, 0.0, 1.0, 0.0),), distances)

    assert distances[0] == pytest.approx(1.3)


def test_a_ray_along_a_face_misses_a_parallel_wall():
    """The ray's direction across the wall is exactly 0, and must not be a divisor."""
    wall = Block(0.0, 1.0, 0.0, (4.0, 0.1))

    assert cast(wall, -3.0, 0.0, 0.0) == 10.0
    assert cast(wall, -3.0, 1.0, 0.0) == pytest.approx(1.0)


def test_a_ray_from_inside_is_0_long():
    """A sensor inside a wall measures a distance of 0."""
    assert cast(Block(0.0, 0.0, 0.0, (1.0, 1.0)), 0.1, 0.1, 0.3) == 0.0


def test_a_longer_obstacle_does_not_hide_a_nearer_one():
    """A scan only shortens the distances that it gets, so the order of obstacles does not matter."""
    distances = [10.0]
    frame = (0.0, 0.0, 1.0, 0.0)
    Disc(2.0, 0.0, 0.5).scan(frame, AHEAD, distances)
    Disc(5.0, 0.0, 0.5).scan(frame, AHEAD, distances)

    assert distances == [1.5]


def test_a_robot_that_touches_a_hull_is_pushed_off_its_nearest_edge():
    """The triangle is 2 m by 1 m. The robot is next to its slope, then inside it near the long side."""
    wedge = Hull([(0.0, 0.0), (2.0, 0.0), (0.0, 1.0), (0.5, 0.3)])
    slope = (1.0 / math.sqrt(5.0), 2.0 / math.sqrt(5.0))

    assert wedge.corners == [(0.0, 0.0), (2.0, 0.0), (0.0, 1.0)]
    contact = wedge.contact(1.0 + 0.3 * slope[0], 0.5 + 0.3 * slope[1], 0.5)
    assert contact == pytest.approx((*slope, 0.2))
    assert wedge.contact(0.6, 0.1, 0.5) == pytest.approx((0.0, -1.0, 0.6))


def test_a_robot_in_the_middle_of_a_disc_is_pushed_somewhere():
    """All directions out of the disc have the same length, so any of them is right."""
    assert Disc(1.0, 1.0, 0.5).contact(1.0, 1.0, 0.2) == (1.0, 0.0, 0.7)


@pytest.mark.parametrize(
    ("x", "y", "normal"), [(0.9, 0.0, (1, 0)), (-0.9, 0.0, (-1, 0)), (0, 0.4, (0, 1)), (0, -0.4, (0, -1))]
)
def test_a_robot_whose_middle_is_in_a_block_leaves_by_the_nearest_face(x, y, normal):
    """A robot that was put partly into a wall must not come out on the other side."""
    contact = Block(0.0, 0.0, 0.0, (2.0, 1.0)).contact(x, y, 0.1)

    assert contact[:2] == pytest.approx(normal)


@given(
    obstacles=st.lists(obstacles, max_size=5),
    x=st.floats(-600, 600),
    y=st.floats(-600, 600),
    reach=st.floats(0, 2),
)
def test_a_neighborhood_forgets_nothing_in_reach(obstacles, x, y, reach):
    """The neighborhood may contain obstacles out of reach, but must not lack one in reach."""
    near = Neighborhood(obstacles, reach).near(x, y)

    assert [it for it in obstacles if it.gap(x, y) <= reach and it not in near] == []


def test_a_neighborhood_is_bounded():
    """A robot that drives away for ever must not use up the memory."""
    neighborhood = Neighborhood([Disc(0.0, 0.0, 1.0)], 0.5)

    for i in range(2 * Neighborhood.LIMIT):
        neighborhood.near(i * 0.2, 0.0)

    assert len(neighborhood._squares) <= Neighborhood.LIMIT
