"""Commands of Webots' motors to MuJoCo's actuators, beyond those of a usual program."""

import math

import pytest

from palaestra_sim.ros_interfaces import UnsimulatedError
from tests.unit.mjcf.conftest import FORCE, POSITION, VELOCITY

UNLIMITED = '<position name="push" joint="slider" kp="500" dampratio="1"/>'
TENDON = (
    "<sensor>",
    '<tendon><fixed name="rope"><joint joint="slider" coef="2"/></fixed></tendon><sensor>',
)
ROPE = '<position name="push" tendon="rope" kp="500" dampratio="1"/>'
SITE = '<motor name="push" site="chip" gear="3 4 0 0 0 0"/>'


def motor_of(simulation):
    """Return the motor of the cart."""
    return simulation.robots[0].motors["push"]


def place(simulation):
    """Return the position of the cart."""
    return simulation.robots[0].sensors["cart position"].value


@pytest.mark.parametrize(("velocity", "sign"), [(0.5, 1.0), (-0.5, -1.0)])
def test_a_position_servo_without_a_target_moves_at_its_velocity(load, velocity, sign):
    """A program for wheels sets an infinite target; the servo then moves its target at the velocity."""
    simulation = load(UNLIMITED)
    motor = motor_of(simulation)
    motor.set_position(math.inf)
    motor.set_velocity(velocity)

    simulation.step(1000)

    assert place(simulation) == pytest.approx(sign * 0.5, abs=0.05)


def test_a_position_servo_without_a_target_stops_at_the_limit_of_its_commands(load):
    """The joint cannot follow a target beyond the limit of the control, so it would come back too late."""
    simulation = load(POSITION)
    motor = motor_of(simulation)
    motor.set_position(-math.inf)
    motor.set_velocity(1.0)
    simulation.step(4000)
    assert place(simulation) == pytest.approx(-1.5, abs=0.05)

    motor.set_velocity(-1.0)
    simulation.step(1000)

    assert place(simulation) == pytest.approx(-0.5, abs=0.1)


@pytest.mark.parametrize("actuator", [UNLIMITED, VELOCITY])
def test_a_servo_without_a_target_and_a_velocity_stays(load, actuator):
    """Until a client sets a velocity it is infinite, and no motor moves infinitely fast."""
    simulation = load(actuator)

    motor_of(simulation).set_position(math.inf)
    simulation.step(200)

    assert place(simulation) == pytest.approx(0.0, abs=1e-6)


def test_a_velocity_servo_accelerates_within_its_limit(load):
    """A robot must not slip when it starts. At 0.2 m/s2 it moves a tenth of a meter in the first second."""
    simulation = load(VELOCITY)
    motor = motor_of(simulation)
    motor.set_position(math.inf)
    motor.set_velocity(5.0)
    motor.set_acceleration(0.2)

    simulation.step(1000)

    assert place(simulation) == pytest.approx(0.1, abs=0.02)


@pytest.mark.parametrize("actuator", [FORCE, POSITION])
def test_gains_are_refused_where_the_model_has_them(load, actuator):
    """If the command succeeded, a person would tune gains without effect."""
    motor = motor_of(load(actuator))
    p, i, d = motor.spec.gains

    motor.set_control_pid(p, i, d)

    with pytest.raises(UnsimulatedError, match="only kp and kv in the model can set its gains"):
        motor.set_control_pid(p + 1.0, i, d)
    assert motor.gains == (p, i, d)


@pytest.mark.parametrize(("actuator", "held"), [(POSITION, 0.7), (VELOCITY, 0.7)])
def test_a_commanded_servo_holds_the_joint_position_that_a_client_sets(load, actuator, held):
    """Without a new target, the servo would pull the joint back to the old target within the next step."""
    simulation = load(actuator)
    motor = motor_of(simulation)
    motor.set_velocity(1.0)
    motor.set_position(-0.5)
    simulation.step(500)

    simulation.set_joint_position(simulation.tree.of_def("slider"), held, 1)
    simulation.step(500)

    assert place(simulation) == pytest.approx(held, abs=0.05)


def test_the_position_of_a_tendon_is_its_length_by_the_gear(load):
    """With the coefficient 2, the length of the tendon is twice the position of its joint."""
    simulation = load(ROPE, "", TENDON)
    motor = motor_of(simulation)

    motor.set_position(0.8)
    simulation.step(3000)

    assert motor.angle_rad == pytest.approx(0.8, abs=0.02)
    assert place(simulation) == pytest.approx(0.4, abs=0.02)


def test_a_thruster_has_a_force_and_no_position(load):
    """A force on a site moves a body in the direction of the gear, and no joint has its position."""
    simulation = load(SITE, "", ('damping="0.01"', 'damping="1000"'))
    motor = motor_of(simulation)
    motor.set_effort(5.0)

    simulation.step(500)

    assert motor.feedback_nm == pytest.approx(5.0)
    assert motor.angle_rad == 0.0
    assert place(simulation) == pytest.approx(0.5 * 3.0 / 1.1 * 0.25, rel=0.05)


def test_the_force_of_an_actuator_is_the_smaller_of_its_two_limits(load):
    """`ctrlrange` limits the command and `forcerange` the force; the gear is 2."""
    limited = FORCE.replace("/>", ' forcerange="-3 4" forcelimited="true"/>')

    assert motor_of(load()).spec.max_torque_nm == pytest.approx(20.0)
    assert motor_of(load(limited)).spec.max_torque_nm == pytest.approx(8.0)
