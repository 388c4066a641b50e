"""The limits and settings of motors, and the state that their controller returns."""

from __future__ import annotations

import math
from dataclasses import dataclass

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.webots.device import JointDevice, number_fact, text_fact

NO_LIMIT = -1.0  # of an acceleration


@dataclass(frozen=True, slots=True, kw_only=True)
class MotorLimits:
    """The limits of a motor in the world, in rad and N m, or in m and N for a linear motor.

    Attributes:
        min_position: the least position; equal to `max_position` without a limit.
        max_position: the greatest position.
        max_velocity: the greatest velocity, in units per second.
        max_effort: the greatest torque or force.
    """

    min_position: float
    max_position: float
    max_velocity: float
    max_effort: float


class MotorDevice(JointDevice):
    """A motor on a joint; every method may raise SimulatorDead, SimulatorHung or WrongData.

    Numbers are in rad and N m, or in m and N for a linear motor. An effort is a torque or a force.
    """

    __slots__ = ()
    nodes = ("RotationalMotor", "LinearMotor")
    target_position = number_fact("get_target_position", "The position that was set last, in rad or m.")
    target_velocity = number_fact("get_velocity", "The velocity that was set last, in rad/s or m/s.")
    acceleration = number_fact(
        "get_acceleration", "The greatest acceleration, in rad/s2 or m/s2; -1: no limit."
    )
    multiplier = number_fact("get_multiplier", "The factor between the motor's commands and its joint.")
    brake_name = text_fact("get_brake_name", 'The name of the brake on the same joint; "" without a brake.')
    position_sensor_name = text_fact(
        "get_position_sensor_name", 'The name of the position sensor on the same joint; "" without one.'
    )

    @property
    def available_effort(self) -> float:
        """The torque or force that the motor may use, in N m or N."""
        return self._number(f"get_available_{self._effort()}")

    @property
    def limits(self) -> MotorLimits:
        """The limits of the motor."""
        return MotorLimits(
            min_position=self._number("get_min_position"),
            max_position=self._number("get_max_position"),
            max_velocity=self._number("get_max_velocity"),
            max_effort=self._number(f"get_max_{self._effort()}"),
        )

    def set_acceleration(self, acceleration: float) -> None:
        """Set the greatest acceleration under position and velocity control; -1 means no limit.

        Raises:
            ConfigurationError: the value is not finite, or is negative and not -1; Webots would ignore it.
        """
        if not (math.isfinite(acceleration) and (acceleration >= 0.0 or acceleration == NO_LIMIT)):
            raise ConfigurationError(
                f"{self.device}: the acceleration {acceleration:g} is refused; use 0 or more, or -1 for no"
                " limit"
            )
        self._command("set_acceleration", "set_float", value=acceleration)

    def set_available_effort(self, effort: float) -> None:
        """Set the torque or force that the motor may use, from 0 to `limits.max_effort`.

        Raises:
            ConfigurationError: the effort is outside this range; Webots would use the limit instead.
            WrongData: also if the simulator is the stub, and the effort is neither 0 nor the limit.
        """
        effort_name = self._effort()
        most = self._number(f"get_max_{effort_name}")
        if not 0.0 <= effort <= most:
            raise ConfigurationError(
                f"{self.device}: the {effort_name} {effort:g} is refused; use 0 to {most:g}"
            )
        name = f"available_{effort_name}"
        self._command(f"set_{name}", "set_float", value=effort)
        self._require_kept(name, effort, self._number(f"get_{name}"))

    def set_gains(self, proportional: float, integral: float = 0.0, derivative: float = 0.0) -> None:
        """Set the gains of the position control, which turns an error of position into a velocity.

        Raises:
            ConfigurationError: the first gain is not positive, or another one is negative; Webots would
                ignore them.
        """
        if not (proportional > 0.0 and integral >= 0.0 and derivative >= 0.0):
            raise ConfigurationError(
                f"{self.device}: the gains {proportional:g}, {integral:g}, {derivative:g} are refused; use a"
                " positive first gain, and 0 or more for the others"
            )
        gains = {"controlp": proportional, "controli": integral, "controld": derivative}
        self._command("set_control_pid", "motor_set_control_pid", **gains)

    def _effort(self) -> str:
        return "force" if self.slides else "torque"

    def _number(self, service: str) -> float:
        return float(self.ask_once(service, "get_float").value)
