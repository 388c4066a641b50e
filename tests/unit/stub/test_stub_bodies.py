"""Robots with any wheels and outline on the floor: pairs of wheels, boxes, and rows of discs."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_sim.scene.mobile_base import MobileBase
from palaestra_sim.scene.motors import Motor, MotorSpec
from palaestra_sim.scene.wheel_kinematics import Wheel, find_drive
from palaestra_sim.stub.body import StubBody
from palaestra_sim.stub.obstacles import Block, Disc, Neighborhood
from palaestra_sim.stub.outline import RoundPart, discs_of_box
from palaestra_sim.stub.rays import Fan

STEP_S = 0.032
RADIUS = 0.2
ROUND = (RoundPart(0.0, 0.0, RADIUS),)
LONG = discs_of_box(0.0, 0.0, 0.0, 0.6, 0.2)
PAIR = [Wheel(x_m=0.0, y_m=y_m, axle=(0.0, 1.0), radius_m=0.05) for y_m in (0.1, -0.1)]


@pytest.fixture
def pair():
    """`pair(outline, obstacles, others)` returns a body on two wheels, and a function that drives it."""

    def make(outline=ROUND, obstacles=(), others=()):
        motors = [Motor(MotorSpec(name=name, max_velocity_rad_s=100.0)) for name in ("left", "right")]
        body = StubBody(MobileBase(motors, find_drive(PAIR)), outline)
        body.face(Neighborhood(obstacles, body.radius), others)

        def go(left, right, steps):
            for motor, speed in zip(motors, (left, right), strict=True):
                motor.set_position(math.inf)
                motor.set_velocity(speed)
            for _ in range(steps):
                body.advance(STEP_S)

        return body, go

    return make


def test_two_wheels_drive_a_robot(pair):
    """With equal speeds the robot drives straight; with a faster right wheel it turns left."""
    body, go = pair()

    go(4.0, 4.0, 10)
    assert (body.x, body.y, body.heading_rad) == pytest.approx((4.0 * 0.05 * 10 * STEP_S, 0.0, 0.0))
    go(-1.0, 1.0, 10)

    assert body.heading_rad == pytest.approx(1.0 * 0.05 / 0.1 * 10 * STEP_S)


def test_two_wheels_speed_up_as_three_do(pair):
    """The acceleration forward is limited to 10 m/s2, whatever the number of wheels."""
    body, go = pair()

    go(60.0, 60.0, 1)
    assert body.velocity[0] == pytest.approx(10.0 * STEP_S)
    go(60.0, 60.0, 20)

    assert body.velocity[0] == pytest.approx(3.0)


def test_a_pushed_pair_of_wheels_keeps_what_it_can(pair):
    """A sideways push ends with the next step, because the wheels hold; a push straight ahead fades."""
    body, go = pair()

    body.push(2.0, 1.0, 0.0)
    assert body.velocity == (2.0, 1.0, 0.0)
    go(0.0, 0.0, 1)

    assert body.velocity[0] == pytest.approx(2.0 - 10.0 * STEP_S)
    assert body.velocity[1] == pytest.approx(0.0)


def test_a_body_without_wheels_stays():
    """Without wheels the body cannot roll, so a push ends with the next step."""
    body = StubBody(MobileBase(), ROUND)
    body.push(1.0, 0.0, 0.5)

    body.advance(STEP_S)

    assert (body.x, body.velocity) == (0.0, (0.0, 0.0, 0.0))


def test_a_drive_wants_one_motor_a_wheel():
    """A wrong number of motors is a bug of the loader, so no world can cause it."""
    with pytest.raises(ValueError, match="do not fit a drive of 2 wheels"):
        MobileBase([Motor(MotorSpec(name="alone"))], find_drive(PAIR))


@pytest.mark.parametrize(("heading", "half"), [(0.0, 0.3), (math.pi / 2, 0.1), (math.pi, 0.3)])
def test_a_long_robot_stops_at_a_wall_with_its_own_side(heading, half):
    """With a single disc as its outline, a long robot would stop too early or enter the wall."""
    body = StubBody(MobileBase(), LONG)
    body.face(Neighborhood([Block(1.05, 0.0, 0.0, (0.1, 4.0))], body.radius), ())
    body.place(1.0 - half + 0.02, 0.0, heading)

    body.advance(STEP_S)

    assert body.x == pytest.approx(1.0 - half)
    assert body.touched


def test_a_long_robot_that_turns_at_a_wall_moves_off(pair):
    """The wall pushes the whole robot away, so that no part of it enters the wall."""
    body, go = pair(LONG, [Block(0.0, 1.05, 0.0, (40.0, 0.1))])
    body.place(0.0, 0.85, 0.0)

    go(-2.0, 2.0, 30)

    front = max(disc.y + disc.radius for disc in body.discs)
    assert front == pytest.approx(1.0)
    assert body.y < 0.8
    assert body.touched


def test_a_fast_turn_does_not_swing_through_a_pole(pair):
    """In one step, the end of a long robot moves further than the thickness of the pole."""
    pole = Disc(0.0, 0.5, 0.01)
    body, go = pair(discs_of_box(0.0, 0.0, 0.0, 1.2, 0.04), [pole])
    body.place(0.0, 0.0, math.pi / 2 - 0.5)

    go(-80.0, 80.0, 12)

    assert body.touched
    assert all(disc.gap(pole.x, pole.y) >= pole.radius - 0.002 for disc in body.discs)


def test_an_outline_beside_the_origin_goes_along(pair):
    """The robot's outline is a disc that is not at its origin, so the disc must turn with the robot."""
    body, _ = pair([RoundPart(0.2, 0.1, 0.05)])

    body.place(1.0, 2.0, math.pi / 2)

    (disc,) = body.discs
    assert (disc.x, disc.y, disc.radius) == pytest.approx((0.9, 2.2, 0.05))
    assert body.radius == pytest.approx(math.hypot(0.2, 0.1) + 0.05)


def test_a_robot_meets_every_disc_of_another(pair):
    """The end of a long robot is a disc of its own; both robots report the contact."""
    other = StubBody(MobileBase(), LONG)
    other.place(1.0, 0.5, 0.0)
    body, go = pair(others=[other])
    body.place(0.0, 0.5, 0.0)

    go(10.0, 10.0, 200)

    assert body.x == pytest.approx(1.0 - 0.3 - RADIUS)
    assert other.touched


def test_rays_meet_every_disc_of_a_robot():
    """A ray may pass the origin of a long robot and still hit the robot's end."""
    other = StubBody(MobileBase(), LONG)
    other.place(1.0, 0.25, math.pi / 2)
    fan = Fan([(0.0, 0.0, 1.0, 0.0)], [5.0])
    fan.face(Neighborhood((), 0.0), [other])

    assert fan.cast((0.0, 0.0, 1.0, 0.0)) == pytest.approx([0.9], abs=0.015)
    other.place(1.0, 0.35, math.pi / 2)

    assert fan.cast((0.0, 0.0, 1.0, 0.0)) == [5.0]


@given(
    commands=st.lists(st.tuples(st.floats(-20, 20), st.floats(-20, 20), st.integers(1, 30)), max_size=8),
    heading=st.floats(-3, 3),
)
def test_a_long_robot_never_ends_inside_anything(commands, heading):
    """No part of the robot enters a wall, even when the robot turns in a corner."""
    walls = [Block(s * 1.05, 0.0, 0.0, (0.1, 2.2)) for s in (-1, 1)]
    walls += [Block(0.0, s * 1.05, 0.0, (2.2, 0.1)) for s in (-1, 1)]
    motors = [Motor(MotorSpec(name=name, max_velocity_rad_s=100.0)) for name in ("left", "right")]
    body = StubBody(MobileBase(motors, find_drive(PAIR)), LONG)
    body.face(Neighborhood(walls, body.radius), ())
    body.place(0.5, 0.5, heading)
    for motor in motors:
        motor.set_position(math.inf)

    for left, right, steps in commands:
        motors[0].set_velocity(left)
        motors[1].set_velocity(right)
        for _ in range(steps):
            body.advance(STEP_S)
            for disc in body.discs:
                assert abs(disc.x) <= 1.0 - disc.radius + 0.02
                assert abs(disc.y) <= 1.0 - disc.radius + 0.02
