"""The drive of a robot follows from the positions and axles of its wheels.

The expected numbers are computed by hand.
"""

import math
from dataclasses import replace

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from palaestra_sim.scene.wheel_kinematics import STANDING, Ring, Wheel, find_drive
from tests.robotino import ROBOTINO, twist, wheel_speeds

H = math.sqrt(0.5)
LEFT = (0.0, 1.0)  # an axle that points left: a positive speed rolls the wheel forward
small = st.floats(-2.0, 2.0)
velocities = st.tuples(small, small, small)
angles = st.floats(-math.pi, math.pi)
radii = st.floats(0.01, 0.5)


def unit(angle):
    """Return the direction at an angle."""
    return math.cos(angle), math.sin(angle)


def row(places, radius_m, **changes):
    """Return wheels without rollers at these positions, which roll forward."""
    return [Wheel(x_m=x, y_m=y, axle=LEFT, radius_m=radius_m, **changes) for x, y in places]


def mecanum(half_length, half_width, radius_m):
    """Return the wheels of a mecanum robot: front left, front right, rear left, rear right."""
    return [
        Wheel(x_m=i * half_length, y_m=j * half_width, axle=LEFT, radius_m=radius_m, roller=(H, -i * j * H))
        for i in (1, -1)
        for j in (1, -1)
    ]


E_PUCK = row([(0.0, 0.026), (0.0, -0.026)], 0.02)
PIONEER_3DX = row([(0.0, 0.165), (0.0, -0.165)], 0.0975)
PIONEER_3AT = row([(i * 0.134, j * 0.197) for i in (1, -1) for j in (1, -1)], 0.11)


@given(speeds=st.tuples(*[st.floats(-140, 140)] * 3), velocity=velocities)
def test_the_robotino_drives_as_its_sample_controller_says(speeds, velocity):
    """The general solution must equal the formulas of base.c for this robot."""
    drive = find_drive(ROBOTINO)

    assert drive.twist(speeds) == pytest.approx(twist(*speeds), abs=1e-12)
    assert drive.wheel_speeds(*velocity) == pytest.approx(wheel_speeds(*velocity), abs=1e-12)


def test_wheel_speeds_are_those_of_the_sample_controller():
    """As in base.c, a robot that drives forward turns its front wheels in opposite directions.

    Wheel 0 stands still.
    """
    assert wheel_speeds(1.0, 0.0, 0.0) == pytest.approx((0.0, -13.7464, 13.7464), abs=1e-4)
    assert wheel_speeds(0.0, 0.0, 1.0) == pytest.approx((-0.1826 / 0.063,) * 3)


@given(speed=st.floats(-140, 140))
def test_mirrored_wheels_drive_exactly_straight(speed):
    """A rounding error must not turn the robot while it drives straight for hours."""
    drive = find_drive(ROBOTINO)

    assert drive.twist((0.0, -speed, speed))[1:] == (0.0, 0.0)


@pytest.mark.parametrize(
    ("wheels", "speeds", "expected"),
    [
        (E_PUCK, (2.0, 2.0), (0.04, 0.0, 0.0)),
        (E_PUCK, (-1.3, 1.3), (0.0, 0.0, 1.0)),  # 1.3 rad/s * 0.02 m = 1 rad/s * 0.026 m
        (PIONEER_3DX, (1.0, 1.0), (0.0975, 0.0, 0.0)),
        (PIONEER_3DX, (0.0, 2.0), (0.0975, 0.0, 0.195 / 0.33)),
        (PIONEER_3AT, (1.0, 1.0, 1.0, 1.0), (0.11, 0.0, 0.0)),
        (PIONEER_3AT, (-1.0, 1.0, -1.0, 1.0), (0.0, 0.0, 0.11 / 0.197)),
        (PIONEER_3AT, (0.0, 2.0, 0.0, 0.0), (0.055, 0.0, 0.055 / 0.197)),  # one of four wheels adds a quarter
    ],
)
def test_tires_in_rows_drive_straight_and_turn(wheels, speeds, expected):
    """E-puck and Pioneer 3-DX have a differential drive, Pioneer 3-AT has four skid-steered wheels."""
    assert find_drive(wheels).twist(speeds) == pytest.approx(expected)


def test_six_wheels_are_steered_like_four():
    """The wheels of a side have the same speed, and the robot turns about the center of all wheels."""
    rover = row([(i * 0.3, j * 0.25) for i in (1, 0, -1) for j in (1, -1)], 0.1)

    assert find_drive(rover).twist((-1.0, 1.0) * 3) == pytest.approx((0.0, 0.0, 0.4))


def test_an_axle_that_turns_backward_rolls_the_wheel_backward():
    """Both axles of the E-puck point in the same direction; many users' robots have opposed axles."""
    right = replace(E_PUCK[1], axle=(0.0, -1.0))

    assert find_drive([E_PUCK[0], right]).twist((2.0, -2.0)) == pytest.approx((0.04, 0.0, 0.0))


def test_a_robot_may_drive_along_any_axis():
    """A wheel whose axle points along x rolls along -y."""
    pair = [Wheel(x_m=x, y_m=0.0, axle=(1.0, 0.0), radius_m=0.05) for x in (0.1, -0.1)]

    assert find_drive(pair).twist((2.0, 2.0)) == pytest.approx((0.0, -0.1, 0.0))


def test_an_axle_ahead_of_the_origin_swings_the_origin_aside():
    """The robot turns left about a point 0.1 m ahead, so its origin moves to the right."""
    pair = row([(0.1, 0.2), (0.1, -0.2)], 0.05)

    assert find_drive(pair).twist((-4.0, 4.0)) == pytest.approx((0.0, -0.1, 1.0))


def test_where_tires_and_rollers_are_mixed_the_tires_hold_sideways():
    """Two tires at the rear hold the robot sideways, so it turns about the rear axle."""
    front = row([(0.3, 0.2), (0.3, -0.2)], 0.05, roller=(1.0, 0.0))
    rear = row([(0.0, 0.2), (0.0, -0.2)], 0.05)

    assert find_drive(front + rear).twist((-4.0, 4.0, -4.0, 4.0)) == pytest.approx((0.0, 0.0, 1.0))


def test_a_parallel_row_of_rollers_turns_about_its_middle():
    """No wheel holds or drives the robot sideways, so it turns about the middle of all wheels."""
    wheels = row([(0.3, 0.2), (-0.1, 0.2), (0.3, -0.2), (-0.1, -0.2)], 0.05, roller=(-1.0, 0.0))

    assert find_drive(wheels).twist((-4.0, -4.0, 4.0, 4.0)) == pytest.approx((0.0, -0.1, 1.0))


@pytest.mark.parametrize(
    ("speeds", "expected"),
    [
        ((4.0, 4.0, 4.0, 4.0), (0.2, 0.0, 0.0)),
        ((-4.0, 4.0, 4.0, -4.0), (0.0, 0.2, 0.0)),
        ((-4.0, 4.0, -4.0, 4.0), (0.0, 0.0, 0.5)),  # 4 * 0.05 / (0.228 + 0.172)
    ],
)
def test_a_mecanum_robot_drives_in_every_direction(speeds, expected):
    """The rollers at 45 degrees add up to any motion.

    The wheels are front left, front right, rear left and rear right.
    """
    drive = find_drive(mecanum(0.228, 0.172, 0.05))

    assert drive.twist(speeds) == pytest.approx(expected)
    assert drive.wheel_speeds(*expected) == pytest.approx(speeds)


def test_four_crossed_wheels_move_in_every_direction():
    """Each side of a square has an omnidirectional wheel, which has rollers or low friction."""
    cross = [
        Wheel(x_m=0.2 * c, y_m=0.2 * s, axle=(c, s), radius_m=0.05)
        for c, s in ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))
    ]
    rolling = [replace(wheel, roller=wheel.forward) for wheel in cross]

    for wheels in (cross, rolling):
        drive = find_drive(wheels)
        assert drive.twist((0.0, 4.0, 0.0, -4.0)) == pytest.approx((0.2, 0.0, 0.0))
        assert drive.twist((-4.0,) * 4) == pytest.approx((0.0, 0.0, 1.0))


@given(
    middle=st.tuples(small, small),
    heading=angles,
    half=st.floats(0.02, 1.0),
    radius=radii,
    velocity=st.tuples(small, small),
)
def test_a_pair_of_wheels_follows_all_that_it_can(middle, heading, half, radius, velocity):
    """A pair of wheels can drive forward and turn, and must follow such a motion exactly."""
    c, s = unit(heading)
    x, y = middle
    pair = [Wheel(x_m=x - i * half * s, y_m=y + i * half * c, axle=(-s, c), radius_m=radius) for i in (1, -1)]
    speed, omega = velocity
    reachable = (speed * c + omega * y, speed * s - omega * x, omega)
    drive = find_drive(pair)

    assert drive.twist(drive.wheel_speeds(*reachable)) == pytest.approx(reachable, abs=1e-9)


@given(
    wheels=st.lists(
        st.builds(
            Wheel,
            x_m=small,
            y_m=small,
            axle=angles.map(unit),
            radius_m=radii,
            roller=st.none() | angles.map(unit),
        ),
        max_size=6,
    ),
    velocity=velocities,
)
def test_a_drive_is_finite_and_gives_back_what_it_can_follow(wheels, velocity):
    """A motion that the drive itself has returned must be one that it can follow exactly."""
    drive = find_drive(wheels)
    assume(drive is not None)

    followed = drive.twist(drive.wheel_speeds(*velocity))

    assert all(map(math.isfinite, followed))
    assert drive.twist(drive.wheel_speeds(*followed)) == pytest.approx(followed, abs=1e-8)


@pytest.mark.parametrize(
    "wheels",
    [
        [],
        E_PUCK[:1],
        row([(0.2, 0.0), (-0.2, 0.0)], 0.05),  # one wheel behind the other, as on a bicycle
        [*row([(0.0, 0.1)], 0.05), Wheel(x_m=0.0, y_m=-0.1, axle=(1.0, 0.0), radius_m=0.05)],  # two, crossed
        [replace(wheel, radius_m=0.0) for wheel in E_PUCK],
        [replace(wheel, x_m=math.nan) for wheel in E_PUCK],
        [replace(wheel, y_m=math.inf) for wheel in E_PUCK],
        [replace(wheel, roller=LEFT) for wheel in E_PUCK],  # rollers about the axle, which transmit no force
        mecanum(0.2, 0.2, 0.05)[:2],
        [replace(it, roller=(it.x_m, it.y_m)) for it in mecanum(H, H, 0.05)],  # all rollers at the middle
        [Wheel(x_m=1.0, y_m=1.0, axle=unit(i), radius_m=0.1) for i in range(3)],  # all wheels at one position
    ],
)
def test_wheels_that_cannot_steer_drive_nothing(wheels):
    """The loader then rejects the robot, or lets its joints turn without driving the robot."""
    assert find_drive(wheels) is None


def test_axles_that_are_parallel_but_for_rounding_are_parallel():
    """If two axles with two degrees of toe were not a pair, the solution would drive the robot sideways."""
    toed = [replace(wheel, axle=unit(math.pi / 2 + i * 0.02)) for i, wheel in enumerate(PIONEER_3AT)]

    assert abs(find_drive(toed).twist((1.0, 1.0, 1.0, 1.0))[0]) == pytest.approx(0.11, rel=0.01)
    assert len(find_drive(toed[:2]).to_twist) == 2


def test_no_wheels_do_not_move():
    """A robot without wheels has this drive, which never moves it."""
    assert STANDING.twist(()) == (0.0, 0.0, 0.0)
    assert STANDING.wheel_speeds(1.0, 1.0, 1.0) == ()


def test_a_ring_of_wheels_that_a_file_rounds_is_exact():
    """The arena's file has four digits. Its Robotino must still drive exactly as by its own controller."""
    rounded = [
        Wheel(
            x_m=round(it.x_m, 4),
            y_m=round(it.y_m, 3),
            axle=rounded_direction(it.axle, 3),
            radius_m=it.radius_m,
        )
        for it in ROBOTINO
    ]
    assert rounded != list(ROBOTINO)

    drive = find_drive(rounded)

    assert drive.twist((1.0, 2.0, 3.0)) == pytest.approx(twist(1.0, 2.0, 3.0), rel=1e-12)


@pytest.mark.parametrize("changed", [{"radius_m": 0.07}, {"x_m": 0.1}, {"axle": (0.6, -0.8)}])
def test_wheels_that_are_no_ring_are_taken_as_they_are(changed):
    """A user's robot may really be built with such wheels."""
    assert isinstance(find_drive(ROBOTINO), Ring)
    assert not isinstance(find_drive([ROBOTINO[0], replace(ROBOTINO[1], **changed), ROBOTINO[2]]), Ring)


@given(angle=angles, velocity=velocities)
def test_a_ring_may_be_turned(angle, velocity):
    """In a user's world, the front of the same robot may be at another angle."""
    c, s = math.cos(angle), math.sin(angle)
    turned = [
        replace(
            it,
            x_m=c * it.x_m - s * it.y_m,
            y_m=s * it.x_m + c * it.y_m,
            axle=(c * it.axle[0] - s * it.axle[1], s * it.axle[0] + c * it.axle[1]),
        )
        for it in ROBOTINO
    ]
    drive = find_drive(turned)

    assert isinstance(drive, Ring)
    assert drive.twist(drive.wheel_speeds(*velocity)) == pytest.approx(velocity, abs=1e-9)


def rounded_direction(direction, digits):
    """Return a direction that is rounded to some digits and scaled to length 1 again."""
    x, y = (round(part, digits) for part in direction)
    return x / math.hypot(x, y), y / math.hypot(x, y)
