"""The velocities that the facade sends to the wheels, and when it sends a velocity again."""

import math

import pytest

from palaestra_trainer.errors import WrongData
from palaestra_trainer.robots import Pose
from palaestra_trainer.robots.robotino import wheel_speeds
from palaestra_trainer.waiting.greenlets import take_turns
from palaestra_trainer.webots import Motor, set_velocities
from palaestra_trainer.webots.services import Services

START = Pose(-1.5, 0.0, 0.0)
AHEAD = (0.5, 0.0, 0.0)
CURVE = (0.3, 0.1, 0.5)  # every wheel turns


class Stranger:
    """A second client of the wheels, which detects whether the facade sends a command."""

    def __init__(self):
        self._services = Services("robotino")

    def tell(self, velocity):
        """Set the velocity of all wheels, in rad/s."""
        for wheel in range(3):
            self._services.get(f"wheel{wheel}_joint/set_velocity", "set_float")(value=velocity)

    def ask(self):
        """Return the commanded velocities of all wheels, in rad/s."""
        return [self._services.ask(f"wheel{wheel}_joint/get_velocity", "get_float") for wheel in range(3)]

    def close(self):
        """Close the connections."""
        self._services.close()


@pytest.fixture
def stranger(master):
    """Yield a second client of the simulator."""
    del master
    somebody = Stranger()
    yield somebody
    somebody.close()


@pytest.fixture
def motor(arena):
    """Yield a wheel as a separate motor."""
    del arena
    wheel = Motor("robotino", "wheel0_joint")
    yield wheel
    wheel.close()


def test_a_velocity_that_did_not_change_is_not_sent_again(arena, stranger):
    """Webots keeps a velocity, and a policy often repeats an action.

    Without the repeated commands, a step needs 12 messages instead of 15.
    """
    arena.robot.drive(*CURVE)
    stranger.tell(7.0)

    arena.robot.drive(*CURVE)

    assert stranger.ask() == [7.0, 7.0, 7.0]


def test_only_the_velocities_that_change_are_sent(arena, stranger):
    """The rear wheel does not turn when the robot drives ahead or back."""
    arena.robot.drive(*AHEAD)
    stranger.tell(7.0)

    arena.robot.drive(-0.5, 0.0, 0.0)

    assert stranger.ask() == [7.0, *wheel_speeds(-0.5, 0.0, 0.0)[1:]]


def test_after_a_reset_it_is_sent_again(arena, stranger):
    """A reset sets the velocities of all motors to 0."""
    arena.robot.drive(*CURVE)
    arena.scene.reset(1, START, (1.0, 0.0))
    assert stranger.ask() == [0.0, 0.0, 0.0]

    arena.robot.drive(*CURVE)

    assert stranger.ask() == pytest.approx(wheel_speeds(*CURVE))


def test_a_reset_to_standing_is_sent_although_it_stood(arena, stranger):
    """A velocity that was confirmed before the reset may not be valid after it."""
    arena.robot.drive(0.0, 0.0, 0.0)
    stranger.tell(7.0)

    arena.scene.reset(1, START, (1.0, 0.0))

    assert stranger.ask() == [0.0, 0.0, 0.0]


def test_after_a_restart_it_is_sent_again(arena, stranger):
    """The new process does not have the velocity of the old one."""
    arena.robot.drive(*CURVE)
    stranger.close()
    arena.webots()

    arena.robot.drive(*CURVE)

    assert stranger.ask() == pytest.approx(wheel_speeds(*CURVE))


def test_after_a_reconnection_it_is_sent_again(arena, stranger):
    """Another client may have changed the velocity meanwhile."""
    arena.robot.drive(*CURVE)
    arena.robot.connect()

    arena.robot.drive(*CURVE)

    assert stranger.ask() == pytest.approx(wheel_speeds(*CURVE))


def test_what_was_not_confirmed_is_sent_again(start, stranger):
    """The second command gets half of a response, so its effect is unknown."""
    arena = start("--fault=wrong_shape:service=wheel1_joint/set_velocity,call=2")
    with pytest.raises(WrongData):
        arena.robot.drive(*CURVE)
    stranger.tell(7.0)

    arena.robot.drive(*CURVE)

    assert stranger.ask() == pytest.approx(wheel_speeds(*CURVE))


def test_a_velocity_that_was_refused_is_sent_again_with_a_new_position(motor, stranger):
    """Webots confirms the command, although it refuses to turn backward to a position."""
    motor.set_position(1.0)
    motor.set_velocity(-2.0)
    assert stranger.ask()[0] != -2.0
    motor.set_position(math.inf)

    set_velocities([(motor, -2.0)])

    assert stranger.ask()[0] == -2.0


def test_a_single_motor_always_sends_its_velocity(motor, stranger):
    """A separate motor is not informed about resets, so it must send every velocity."""
    motor.set_velocity(2.0)
    stranger.tell(7.0)

    motor.set_velocity(2.0)

    assert stranger.ask()[0] == 2.0


def test_others_have_their_turn_while_the_wheels_answer(arena):
    """Commands to four robots then take the time of one round trip."""
    told = []

    take_turns([lambda: (arena.robot.drive(*CURVE), told.append("this")), lambda: told.append("the other")])

    assert told == ["the other", "this"]
