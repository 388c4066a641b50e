"""Motors of grippers, forks, arms and models of MuJoCo, each with one type of command."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final, Literal

from palaestra_trainer.errors import WorldMisfit, WrongData
from palaestra_trainer.ros import call_together
from palaestra_trainer.waiting.greenlets import let_others
from palaestra_trainer.webots.device import NodeDevice
from palaestra_trainer.webots.devices import NodeSensor
from palaestra_trainer.webots.message_decoding import FLOAT64, NumberReading
from palaestra_trainer.webots.motor_device import MotorDevice

Command = Literal["position", "velocity", "force", "torque", "control"]

_MOTORS: Final[dict[str, tuple[str, ...]]] = {"torque": ("RotationalMotor",), "force": ("LinearMotor",)}


class CommandedDevice(NodeDevice):
    """A device with one type of command.

    Args:
        robot: the ROS name of the robot's controller.
        device: the name of the device in the world.
        command: the type of the command; see `JointMotor`.

    Attributes:
        robot: see above.
        device: see above.
        service: the service that sets the command.
    """

    __slots__ = ("_command_name", "_position", "_ready", "service")

    def __init__(self, robot: str, device: str, command: Command) -> None:
        super().__init__(robot, device)
        self._command_name = command
        self.service = self._services.get(f"{self._path}/set_{command}", "set_float")
        self._position = self._services.get(f"{self._path}/set_position", "set_float")
        self._ready = False

    def set(self, value: float) -> None:
        """Set the command from the next step on.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: as `RosService`.
        """
        with self._explaining():
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

    def release(self) -> None:
        """Send no command, so that the motor keeps the state that the simulator's reset has set.

        The world defines that state: the position in the file, or the control of a keyframe; this control may
        hold a robot upright. A command of 0 would replace that state.
        """
        self._ready = False

    def close(self) -> None:
        """Close the connections."""
        self._ready = False
        super().close()


class JointMotor(CommandedDevice, MotorDevice):
    """A motor with one type of command.

    Args:
        robot: the ROS name of the robot's controller.
        device: the motor's name in the world.
        command: "position" (rad or m), "velocity", "force" (N), "torque" (N m), or "control". "control" is
            for actuators of MuJoCo that have no equivalent motor in Webots, in the units of the actuator.
    """

    __slots__ = ()

    def _wanted_nodes(self) -> tuple[str, ...]:
        return _MOTORS.get(self._command_name, self.nodes)


def set_commands(wanted: Iterable[tuple[CommandedDevice, float]]) -> None:
    """Set commands of motors from the next step on; all requests are sent at once.

    Raises:
        SimulatorDead, SimulatorHung, WrongData: as `RosService`.
    """
    commands = list(wanted)
    for motor, _ in commands:
        motor.prepare()
    call_together([(motor.service, {"value": value}) for motor, value in commands], meanwhile=let_others)


class EffortFeedback(NodeSensor):
    """The torque or force that a motor uses now; `value` is in N m or N. The stub simulates no forces.

    Args:
        robot: the ROS name of the robot's controller.
        device: the motor's name in the world.
        effort: "torque" for a RotationalMotor, "force" for a LinearMotor.
    """

    __slots__ = ("_effort",)
    nodes = ("RotationalMotor", "LinearMotor")

    def __init__(self, robot: str, device: str, effort: Literal["torque", "force"] = "torque") -> None:
        self._effort = effort
        super().__init__(
            robot,
            device,
            "webots_ros/Float64Stamped",
            NumberReading(device, FLOAT64),
            f"{effort}_feedback",
            f"{effort}_feedback_sensor/enable",
        )

    def _wanted_nodes(self) -> tuple[str, ...]:
        return _MOTORS[self._effort]

    def _refused(self, period_ms: int) -> WrongData:
        return WorldMisfit(
            self.robot,
            f"{self.device} refuses to measure its {self._effort} each {period_ms} ms; use a multiple of the"
            " step, and a simulator with forces for this joint, such as driver mujoco",
        )
