"""Motors of grippers, forks, arms and models of MuJoCo, each with one type of command."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from palaestra_trainer.ros import call_together
from palaestra_trainer.waiting.greenlets import let_others
from palaestra_trainer.webots.devices import Sensor, topic_name
from palaestra_trainer.webots.message_decoding import FLOAT64, NumberReading
from palaestra_trainer.webots.services import Services

Command = Literal["position", "velocity", "force", "torque", "control"]


_ROTATIONAL = 0  # the type of a motor; 1 is linear. Source: webots/motor.h


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


class JointMotor:
    """A motor with one type of command.

    Args:
        robot: the ROS name of the robot's controller.
        device: the motor's name in the world.
        command: "position" (rad or m), "velocity", "force" (N), "torque" (N m), or "control". "control" is
            for actuators of MuJoCo that have no equivalent motor in Webots, in the units of the actuator.

    Attributes:
        robot: see above.
        device: see above.
        service: the service that sets the command.
    """

    __slots__ = ("_path", "_position", "_ready", "_services", "device", "robot", "service")

    def __init__(self, robot: str, device: str, command: Command) -> None:
        self._services = Services(robot)
        name = self._path = topic_name(device)
        self.robot = robot
        self.device = device
        self.service = self._services.get(f"{name}/set_{command}", "set_float")
        self._position = self._services.get(f"{name}/set_position", "set_float")
        self._ready = False

    def set(self, value: float) -> None:
        """Set the command from the next step on.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: as `RosService`.
        """
        self.prepare()
        self.service(value=value)

    def prepare(self) -> None:
        """Prepare the motor for commands of `service`, before the first command after a reset.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: as `RosService`.
        """
        if not self._ready and self.service.name.endswith("set_velocity"):
            self._position(value=math.inf)
        self._ready = True

    def limits(self) -> MotorLimits:
        """Return the limits of the motor.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: as `RosService`.
        """
        numbers = {
            name: self._number(f"get_{name}") for name in ("min_position", "max_position", "max_velocity")
        }
        return MotorLimits(**numbers, max_effort=self._number(f"get_max_{self._effort()}"))

    def target(self) -> float:
        """Return the target position, in rad or m.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: as `RosService`.
        """
        return self._number("get_target_position")

    def set_acceleration(self, acceleration: float) -> None:
        """Set the greatest acceleration under position and velocity control; -1 means without a limit.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: as `RosService`.
        """
        self._set("acceleration", acceleration)

    def set_available_effort(self, effort: float) -> None:
        """Set the torque or force that the motor may use, from 0 to `limits().max_effort`.

        Raises:
            SimulatorDead, SimulatorHung: as `RosService`.
            WrongData: also if the simulator ignores the value.
        """
        name = f"available_{self._effort()}"
        self._set(name, effort)
        self._services.require_kept(self.device, name, effort, self._number(f"get_{name}"))

    def _effort(self) -> str:
        rotational = self._services.ask(f"{self._path}/get_type", "get_int") == _ROTATIONAL
        return "torque" if rotational else "force"

    def _number(self, name: str) -> float:
        return float(self._services.ask(f"{self._path}/{name}", "get_float"))

    def _set(self, name: str, value: float) -> None:
        refused = f"{self.device} refuses the {name} {value:g}"
        self._services.confirm(f"{self._path}/set_{name}", "set_float", refused, value=value)

    def release(self) -> None:
        """Send no command, so that the motor keeps the state that the simulator's reset has set.

        The world defines that state: the position in the file, or the control of a keyframe; this control may
        hold a robot upright. A command of 0 would replace that state.
        """
        self._ready = False

    def close(self) -> None:
        """Close the connections."""
        self._ready = False
        self._services.close()


def set_commands(wanted: Iterable[tuple[JointMotor, float]]) -> None:
    """Set commands of motors from the next step on; all requests are sent at once.

    Raises:
        SimulatorDead, SimulatorHung, WrongData: as `RosService`.
    """
    commands = list(wanted)
    for motor, _ in commands:
        motor.prepare()
    call_together([(motor.service, {"value": value}) for motor, value in commands], meanwhile=let_others)


class EffortFeedback(Sensor):
    """The torque or force that a motor uses now; `value` is in N m or N. The stub simulates no forces.

    Args:
        robot: the ROS name of the robot's controller.
        device: the motor's name in the world.
        effort: "torque" for a RotationalMotor, "force" for a LinearMotor.
    """

    __slots__ = ()

    def __init__(self, robot: str, device: str, effort: Literal["torque", "force"] = "torque") -> None:
        super().__init__(
            robot,
            device,
            "webots_ros/Float64Stamped",
            NumberReading(device, FLOAT64),
            f"{effort}_feedback",
            f"{effort}_feedback_sensor/enable",
        )
