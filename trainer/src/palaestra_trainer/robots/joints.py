"""Simulated robots with joints, such as arms, cart-poles and models of MuJoCo."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.robots.capabilities import Joints
from palaestra_trainer.robots.simulated import SimulatedRobot
from palaestra_trainer.webots import Command, JointMotor, PositionSensor, set_commands


class JointRobot(SimulatedRobot, Joints):
    """A robot that moves its joints; the arguments are those of `SimulatedRobot`.

    A subclass names the motors and sensors of its robot. In a model of MuJoCo, every sensor with one number
    is a PositionSensor, so `sensors` may also name sensors of rates.

    Attributes:
        motors: names of the robot's motors.
        sensors: names of the robot's PositionSensors.
        greatest: the greatest command of each motor, in the unit of `command`.
        commanded: the quantity that `command` sets: position (rad, m), velocity, force (N) or torque (N m).
            The value "control" is for actuators of MuJoCo that have no equivalent motor in Webots, such as
            "mujoco/biceps".

    Raises:
        ConfigurationError: the class names no motors, or `greatest` does not have one number for each motor.
    """

    target = None
    motors: ClassVar[tuple[str, ...]] = ()
    sensors: ClassVar[tuple[str, ...]] = ()
    greatest: ClassVar[tuple[float, ...]] = ()
    commanded: ClassVar[Command] = "force"

    def __init__(self, *arguments: Any, **options: Any) -> None:
        if not self.motors or len(self.motors) != len(self.greatest):
            raise ConfigurationError(
                f"trainer.robot: {type(self).__name__} has {len(self.motors)} motors and "
                f"{len(self.greatest)} numbers in greatest; set both in a subclass, with one number for "
                "each motor"
            )
        super().__init__(*arguments, **options)

    def equip(self) -> None:
        """Add the motors and sensors."""
        self._motors = tuple(JointMotor(self.node_name, motor, self.commanded) for motor in self.motors)
        self._sensors = tuple(PositionSensor(self.node_name, sensor) for sensor in self.sensors)
        self.simulation.add(self._sensors, self._motors)

    def joints(self) -> NDArray[np.float64]:
        """Return a new array with the readings of `sensors`, shape (sensors,)."""
        values = [sensor.value for sensor in self._sensors]
        if None in values:
            raise self._no_reading()
        return np.array(values, np.float64)

    def command(self, values: Iterable[float]) -> None:
        """Set the command of each motor, clipped to `greatest`, until the next command."""
        set_commands(
            (motor, min(max(float(value), -most), most))
            for motor, value, most in zip(self._motors, values, self.greatest, strict=True)
        )
