"""The firmware of the mock robot's base: the dead man's switch and the limits of the acceleration."""

from hypothesis import given
from hypothesis import strategies as st

from palaestra_sim.mock_robot.base import STOP, BaseFirmware, approach

LIMITS = (10.0, 6.0, 20.0)  # the Robotino's accelerations, in m/s2, m/s2 and rad/s2
AHEAD = (0.5, 0.0, 0.0)
speeds = st.floats(-3.0, 3.0)
velocities = st.tuples(speeds, speeds, speeds)
steps = st.sampled_from([0.008, 0.032, 0.064])


def test_without_a_command_the_robot_stands():
    """A robot that was switched on must wait for its first command."""
    assert BaseFirmware().target(0.0) == STOP


def test_a_command_is_valid_for_200_ms():
    """The REST interface documents this time, so a program that sends every 200 ms must drive."""
    base = BaseFirmware()
    base.command(AHEAD, 1.0)

    assert base.target(1.0) == AHEAD
    assert base.target(1.2) == AHEAD


def test_the_dead_mans_switch_stops_the_robot():
    """A program that hangs must not leave a robot that drives."""
    base = BaseFirmware()
    base.command(AHEAD, 1.0)

    assert base.target(1.201) == STOP


def test_the_newest_command_is_valid():
    """The robot has no lock between clients, so a second client takes the robot over."""
    base = BaseFirmware()
    base.command(AHEAD, 1.0)
    base.command((0.0, 0.3, 0.0), 1.1)

    assert base.target(1.25) == (0.0, 0.3, 0.0)
    assert base.commands == 2
    assert base.last_command_s == 1.1


@given(velocities, velocities, steps)
def test_no_step_exceeds_the_limits(current, target, step_s):
    """At a higher acceleration, the wheels of a real robot would slip, and its motors are too weak for it."""
    reached = approach(current, target, step_s)

    for now, then, limit in zip(current, reached, LIMITS, strict=True):
        assert abs(then - now) <= limit * step_s * (1.0 + 1e-9)


@given(velocities, velocities, steps)
def test_the_robot_reaches_the_target(current, target, step_s):
    """The limits delay a command, but must not change the velocity that the robot reaches in the end."""
    for _ in range(100):  # a change of 6 m/s at 6 m/s2 takes 1 s: at most 63 of these steps
        current = approach(current, target, 2.0 * step_s)

    assert current == target


def test_a_curve_keeps_its_direction():
    """If one axis needs time, the others wait for it, or the robot would start in another direction."""
    vx, vy, _ = approach(STOP, (1.0, 1.0, 0.0), 0.032)

    assert vx == vy == 6.0 * 0.032


def test_an_absurd_command_does_not_break_the_base():
    """JSON allows a velocity that overflows to infinity here; the robot must still obey the next command."""
    assert approach(AHEAD, (1.7e308, 0.0, 0.0), 0.001) == AHEAD
