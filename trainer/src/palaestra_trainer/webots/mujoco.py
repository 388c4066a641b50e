"""Sensors and actuators of MuJoCo models that have no equivalent device in Webots.

A simulator provides these devices under names that begin with `mujoco/`. For example, `mujoco/hip_force` is
the sensor `hip_force` of the model.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from palaestra_protocol.ros.rostypes import message_type
from palaestra_trainer.webots.devices import NodeSensor
from palaestra_trainer.webots.joint_motor import CommandedDevice

_FOLDER: Final = "mujoco/"
_TYPE: Final = "std_msgs/Float64MultiArray"
_decode: Final = message_type(_TYPE).codec.decode


class MujocoSensor(NodeSensor):
    """A sensor of several numbers; `value` has MuJoCo's order and units: shape (numbers,), float64.

    Args:
        robot: the ROS name of the robot's controller.
        sensor: name of the sensor in the model, e.g. hip_force
    """

    __slots__ = ()

    def __init__(self, robot: str, sensor: str) -> None:
        super().__init__(robot, f"{_FOLDER}{sensor}", _TYPE, read_numbers)


class MujocoActuator(CommandedDevice):
    """An actuator without an equivalent motor in Webots, such as a muscle; `set` takes MuJoCo's control.

    The simulator clips the control to the actuator's `ctrlrange`.

    Args:
        robot: the ROS name of the robot's controller.
        actuator: name of the actuator in the model, e.g. biceps
    """

    __slots__ = ()

    def __init__(self, robot: str, actuator: str) -> None:
        super().__init__(robot, f"{_FOLDER}{actuator}", "control")


def read_numbers(message: bytes | memoryview) -> NDArray[np.float64]:
    """Return the numbers of a message in a new array.

    Raises:
        ValueError: a number is not finite, or the message is truncated.
    """
    numbers = _decode(message).data
    if not all(map(math.isfinite, numbers)):
        raise ValueError(f"{numbers}; a sensor of MuJoCo must be finite")
    return np.array(numbers, np.float64)
