"""The Robotino on the floor: kinematics, acceleration, and collisions in which the robot slides."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_sim.scene.mobile_base import MobileBase
from palaestra_sim.scene.motors import Motor, MotorSpec
from palaestra_sim.scene.wheel_kinematics import find_drive
from palaestra_sim.stub.body import StubBody
from palaestra_sim.stub.obstacles import Block, Disc, Neighborhood
from tests.robotino import ROBOTINO, WHEELS, twist, wheel_speeds

STEP_S = 0.032
RADIUS = 0.2
speeds = st.floats(-2, 2)


@pytest.fixture
def build():
    """`build(obstacles, others, **motor)` returns a body, and a function that drives it."""

    def make(obstacles=(), others=(), **spec):
        wheels = [Motor(MotorSpec(name=name, **{"max_velocity_rad_s": 137.46, **spec})) for name in WHEELS]
        for wheel in wheels:
            wheel.set_position(math.inf)
        body = StubBody(MobileBase(wheels, find_drive(ROBOTINO)), [(0.0, 0.0, RADIUS)])
        body.face(Neighborhood(obstacles, RADIUS), others)

        def go(vx, vy, omega, steps):
            for wheel, speed in zip(wheels, wheel_speeds(vx, vy, omega), strict=True):
                wheel.set_velocity(speed)
            for _ in range(steps):
                body.advance(STEP_S)

        return body, go

    return make


@given(vx=speeds, vy=speeds, omega=speeds)
def test_wheel_speeds_and_twist_are_inverse(vx, vy, omega):
    """Three wheels have three degrees of freedom, so the conversion loses nothing."""
    assert twist(*wheel_speeds(vx, vy, omega)) == pytest.approx((vx, vy, omega), abs=1e-9)


def test_wheel_speeds_are_those_of_the_sample_controller():
    """As in base.c, a robot that drives forward turns its front wheels in opposite directions.

    Wheel 0 stands still.
    """
    w0, w1, w2 = wheel_speeds(1.0, 0.0, 0.0)

    assert (w0, w1, w2) == pytest.approx((0.0, -13.7464, 13.7464), abs=1e-4)
    assert wheel_speeds(0.0, 0.0, 1.0) == pytest.approx((-0.1826 / 0.063,) * 3)


@pytest.mark.parametrize(
    ("command", "moved"),
    [
        ((0.3, 0.0, 0.0), (0.3, 0.0, 0.0)),
        ((-0.3, 0.0, 0.0), (-0.3, 0.0, 0.0)),
        ((0.0, 0.15, 0.0), (0.0, 0.15, 0.0)),
        ((0.0, 0.0, 0.6), (0.0, 0.0, 0.6)),
    ],
)
def test_a_second_of_driving_leads_where_it_should(build, command, moved):
    """The speed is so low that the robot reaches it in the first basic step."""
    body, go = build()

    go(*command, 125)
    moved = [4 * it for it in moved]

    assert (body.x, body.y, body.heading_rad) == pytest.approx(moved, abs=1e-9)


def test_sideways_is_sideways_of_the_robot(build):
    """After a quarter turn to the left, the robot's left side points along -x of the world."""
    body, go = build()
    body.place(0.0, 0.0, math.pi / 2)

    go(0.0, 0.1, 0.0, 100)

    assert (body.x, body.y) == pytest.approx((-0.32, 0.0), abs=1e-9)


def test_driving_and_turning_is_a_circle(build):
    """The radius is v / omega.

    After a full turn the circle is closed, up to the error of the midpoint rule.
    """
    body, go = build()
    steps = 400  # the robot is so slow that it reaches its speed in the first step
    omega = 2 * math.pi / (steps * STEP_S)

    go(0.3, 0.0, omega, steps // 2)
    across = math.hypot(body.x, body.y)
    go(0.3, 0.0, omega, steps // 2)

    assert across == pytest.approx(2 * 0.3 / omega, rel=1e-3)
    assert (body.x, body.y) == pytest.approx((0.0, 0.0), abs=1e-3)


def test_the_heading_stays_in_half_a_turn_each_way(build):
    """A client compares the heading with angles from atan2, which are in the same range."""
    body, go = build()

    for _ in range(300):
        go(0.0, 0.0, 5.0, 1)
        assert -math.pi < body.heading_rad <= math.pi


@pytest.mark.parametrize(("axis", "limit"), [(0, 10.0), (1, 6.0), (2, 20.0)])
def test_speeding_up_takes_its_time(build, axis, limit):
    """As in the sample controller, the limits are 10 m/s2, 6 m/s2 and 20 rad/s2."""
    body, go = build()
    command = [0.0, 0.0, 0.0]
    command[axis] = 3.0

    go(*command, 1)
    assert body.velocity[axis] == pytest.approx(limit * STEP_S, rel=0.05)
    go(*command, 100)

    assert math.hypot(*body.velocity) >= 3.0 - 1e-9


def test_all_axes_are_slowed_by_the_same_factor(build):
    """The robot then has the right direction from the first basic step on."""
    body, go = build()

    go(2.0, 2.0, 0.0, 1)

    assert body.velocity[0] == pytest.approx(body.velocity[1])
    assert body.velocity[1] == pytest.approx(6.0 * STEP_S)


def test_a_motor_that_is_slower_than_its_command_bends_the_way(build):
    """The velocity limit of each motor applies, so the robot is slower than commanded."""
    body, go = build(max_velocity_rad_s=5.0)

    go(1.0, 0.0, 0.0, 50)

    assert body.velocity[0] == pytest.approx(twist(0.0, -5.0, 5.0)[0])


def test_a_motor_with_an_acceleration_is_slower_to_start(build):
    """The acceleration limit of a motor applies in addition to that of the robot."""
    body, go = build(acceleration_rad_s2=10.0)

    go(0.3, 0.0, 0.0, 1)

    assert body.velocity[0] == pytest.approx(twist(0.0, -0.32, 0.32)[0])


def test_standing_still_is_exact(build):
    """A standing robot does not drift, so two runs can be compared bit for bit."""
    body, go = build()
    go(0.3, 0.2, 0.1, 40)
    go(0.0, 0.0, 0.0, 10)
    before = (body.x, body.y, body.heading_rad)

    go(0.0, 0.0, 0.0, 100)

    assert (body.x, body.y, body.heading_rad) == before
    assert body.velocity == (0.0, 0.0, 0.0)


def test_a_wall_stops_what_drives_straight_into_it(build):
    """The robot must neither enter the wall nor bounce back."""
    body, go = build([Block(1.05, 0.0, 0.0, (0.1, 4.0))])

    go(0.5, 0.0, 0.0, 200)

    assert (body.x, body.y) == pytest.approx((1.0 - RADIUS, 0.0))
    assert body.velocity[0] == pytest.approx(0.0, abs=1e-9)
    assert body.touched


def test_a_robot_slides_along_a_wall(build):
    """A wall without friction stops only the motion toward it."""
    body, go = build([Block(1.05, 0.0, 0.0, (0.1, 40.0))])
    body.place(0.8, 0.0, 0.0)

    go(0.3, 0.2, 0.0, 100)

    assert body.x == pytest.approx(0.8)
    assert body.velocity[:2] == pytest.approx((0.0, 0.2), abs=1e-9)


def test_a_robot_slides_round_a_cylinder(build):
    """A robot that hits a cylinder off its center passes it at the distance of the two radii."""
    disc = Disc(1.0, 0.0, 0.15)
    body, go = build([disc])
    body.place(0.0, 0.05, 0.0)

    nearest = math.inf
    for _ in range(300):
        go(0.3, 0.0, 0.0, 1)
        nearest = min(nearest, disc.gap(body.x, body.y))

    assert nearest == pytest.approx(RADIUS)
    assert body.x > 1.5


def test_a_corner_holds(build):
    """In the corner the robot has two contacts at a time, and neither may push it into the other wall."""
    walls = [Block(1.05, 0.0, 0.0, (0.1, 4.0)), Block(0.0, 1.05, 0.0, (4.0, 0.1))]
    body, go = build(walls)

    go(0.5, 0.5, 0.0, 200)

    assert (body.x, body.y) == pytest.approx((0.8, 0.8))


def test_wheels_spin_on_at_a_wall(build):
    """The motors turn as commanded, so the robot leaves the wall at once when it is commanded back."""
    body, go = build([Block(1.05, 0.0, 0.0, (0.1, 4.0))])
    go(0.5, 0.0, 0.0, 200)
    before = body.x

    go(-0.1, 0.0, 0.0, 10)

    assert body.x < before - 0.02


@pytest.mark.parametrize("speed", [3.0, 8.0])
def test_nothing_is_fast_enough_to_pass_through_a_wall(build, speed):
    """At full speed, one basic step is longer than the wall is thick."""
    body, go = build([Block(1.05, 0.0, 0.0, (0.1, 4.0))])

    go(speed, 0.0, 0.0, 200)

    assert body.x == pytest.approx(0.8)


def test_at_rest_against_a_wall_nothing_is_touched_any_more(build):
    """Only a push toward the wall is a touch; a rounding error at the surface is not."""
    body, go = build([Block(1.05, 0.0, 0.3, (0.1, 4.0))])
    go(0.5, 0.0, 0.0, 100)
    go(0.0, 0.0, 0.0, 5)
    body.touched = False

    go(0.0, 0.0, 0.0, 50)

    assert not body.touched


def test_a_robot_that_is_put_into_a_wall_is_pushed_out(build):
    """A robot that stands still is pushed out too."""
    body, go = build([Block(1.05, 0.0, 0.0, (0.1, 4.0))])
    body.place(0.95, 0.0, 0.0)

    go(0.0, 0.0, 0.0, 1)

    assert body.x == pytest.approx(0.8)
    assert body.touched


def test_robots_stop_each_other_and_both_feel_it(build):
    """The robot that drives is stopped; the bumper of the other robot reports the touch too."""
    standing, _ = build()
    standing.place(1.0, 0.0, 0.0)
    body, go = build(others=[standing])

    go(0.5, 0.0, 0.0, 200)

    assert body.x == pytest.approx(1.0 - 2 * RADIUS)
    assert body.touched
    assert standing.touched
    assert (standing.x, standing.y) == (1.0, 0.0)


def test_halting_takes_all_motion_and_the_motors_begin_again(build):
    """`reset_physics` sets all velocities to zero and keeps the commands of the motors."""
    body, go = build()
    go(3.0, 0.0, 0.0, 50)

    body.halt()
    assert body.velocity == (0.0, 0.0, 0.0)
    go(3.0, 0.0, 0.0, 1)

    assert body.velocity[0] == pytest.approx(10.0 * STEP_S)


def test_a_push_fades_as_the_motors_take_over(build):
    """A push is given in the axes of the world, whatever the heading of the robot."""
    body, go = build()
    body.place(0.0, 0.0, math.pi / 2)
    body.push(1.0, 0.0, 0.0)
    assert body.velocity == (1.0, 0.0, 0.0)

    go(0.0, 0.0, 0.0, 1)
    assert 0.5 < body.velocity[0] < 1.0
    go(0.0, 0.0, 0.0, 20)

    assert body.velocity == (0.0, 0.0, 0.0)


@given(
    commands=st.lists(
        st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-2, 2), st.integers(1, 40)), max_size=8
    )
)
def test_a_robot_never_ends_inside_anything(commands):
    """Random commands drive a robot in an arena with walls and a cylinder."""
    walls = [Block(s * 1.05, 0.0, 0.0, (0.1, 2.2)) for s in (-1, 1)]
    walls += [Block(0.0, s * 1.05, 0.0, (2.2, 0.1)) for s in (-1, 1)]
    obstacles = [*walls, Disc(0.6, 0.6, 0.1)]
    wheels = [Motor(MotorSpec(name=name, max_velocity_rad_s=137.46)) for name in WHEELS]
    body = StubBody(MobileBase(wheels, find_drive(ROBOTINO)), [(0.0, 0.0, RADIUS)])
    body.face(Neighborhood(obstacles, RADIUS), ())
    for wheel in wheels:
        wheel.set_position(math.inf)

    for vx, vy, omega, steps in commands:
        for wheel, speed in zip(wheels, wheel_speeds(vx, vy, omega), strict=True):
            wheel.set_velocity(speed)
        for _ in range(steps):
            body.advance(STEP_S)
            assert abs(body.x) <= 1.0 - RADIUS + 0.02
            assert abs(body.y) <= 1.0 - RADIUS + 0.02
