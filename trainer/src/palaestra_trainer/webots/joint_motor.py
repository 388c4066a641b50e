"""Motors that one kind of command moves: of grippers, forks, arms and models of MuJoCo."""

from __future__ import annotations

import math
from typing import Literal

from palaestra_trainer.webots.devices import topic_name
from palaestra_trainer.webots.services import Services

Command = Literal["position", "velocity", "force", "torque", "control"]


class JointMotor:
    """A motor under one kind of command.

    Args:
        robot: the ROS name of the robot's controller.
        device: the motor's name in the world.
        command: "position" (rad or m), "velocity", "force" (N), "torque" (N m), or "control" in the units of
            an actuator of MuJoCo that Webots has no motor for.

    Attributes:
        robot: see above.
        device: see above.
        service: sets the command.
    """

    __slots__ = ("_position", "_ready", "_services", "device", "robot", "service")

    def __init__(self, robot: str, device: str, command: Command) -> None:
        self._services = Services(robot)
        name = topic_name(device)
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
        """Let the motor take commands of `service`, before the first one after a reset.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: as `RosService`.
        """
        if not self._ready and self.service.name.endswith("set_velocity"):
            self._position(value=math.inf)
        self._ready = True

    def release(self) -> None:
        """Keep what the simulator's reset has set, until the next command.

        A world gives its motors a state of its own: the position in the file, or the control of a keyframe,
        which holds a robot up. A command of 0 would replace it.
        """
        self._ready = False

    def close(self) -> None:
        """Close the connections."""
        self._ready = False
        self._services.close()
