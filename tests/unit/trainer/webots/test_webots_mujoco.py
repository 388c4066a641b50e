"""Facades of MuJoCo's sensors and actuators that have no equivalent among Webots' devices."""

import math

import numpy as np
import pytest

from palaestra_protocol.ros.rostypes import message_type
from palaestra_trainer.webots.mujoco import MujocoActuator, MujocoSensor, read_numbers


def message(*numbers):
    """Return the bytes of a message."""
    dim = [{"label": "force", "size": len(numbers), "stride": len(numbers)}]
    return memoryview(
        message_type("std_msgs/Float64MultiArray").codec.encode({"layout": {"dim": dim}, "data": numbers})
    )


def test_numbers_are_an_array_of_all():
    """The numbers keep MuJoCo's order, by which an environment finds each number."""
    numbers = read_numbers(message(1.0, -2.5, 0.0))

    assert numbers.dtype == np.float64
    assert numbers.tolist() == [1.0, -2.5, 0.0]


@pytest.mark.parametrize("number", [math.nan, math.inf])
def test_a_number_that_is_not_finite_is_refused(number):
    """A policy must not learn from NaN or infinity."""
    with pytest.raises(ValueError, match=str(number)):
        read_numbers(message(1.0, number))


def test_a_message_cut_short_anywhere_is_refused():
    """A reader that accepted the message would take the length of the list for a number."""
    sound = message(1.0, 2.0)

    for length in range(len(sound)):
        with pytest.raises(ValueError, match="bytes"):
            read_numbers(sound[:length])


def test_devices_have_their_names_below_mujoco():
    """A user finds these names in the device list of the robot."""
    assert MujocoSensor("walker", "hip force").device == "mujoco/hip force"
    actuator = MujocoActuator("walker", "left biceps")
    assert actuator.device == "mujoco/left biceps"
    assert actuator.service.name == "/walker/mujoco/left_biceps/set_control"
