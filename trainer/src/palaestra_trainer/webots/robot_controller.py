"""The controller of a robot: facts about the robot, its data, window and inputs."""

from __future__ import annotations

import enum
from typing import Final

from palaestra_trainer.errors import ConfigurationError, SimulatorDead
from palaestra_trainer.ros import RosService
from palaestra_trainer.ros.service import DEADLINE_S
from palaestra_trainer.webots.device import Device, Fact, flag_fact, text_fact

_MS_PER_S: Final = 1000.0
_LONGEST_WAIT_S: Final = 3600.0


class RobotMode(enum.IntEnum):
    """The robot that a controller controls: simulated or real. Source: webots/robot.h."""

    SIMULATION = 0
    CROSS_COMPILATION = 1
    REMOTE_CONTROL = 2


class InputEvent(enum.IntFlag):
    """Inputs of a person in Webots. Source: webots/robot.h."""

    NONE = 0
    MOUSE_CLICK = 1
    MOUSE_MOVE = 2
    KEYBOARD = 4
    JOYSTICK_BUTTON = 8
    JOYSTICK_AXIS = 16
    JOYSTICK_POV = 32


class RobotController(Device):
    """The controller of one robot.

    Every method may raise SimulatorDead, SimulatorHung or WrongData. `Observer` reads time and world.

    Args:
        robot: the ROS name of the robot's controller.
    """

    __slots__ = ()
    model = text_fact("get_model", "The field `model` of the robot.")
    supervises = flag_fact("get_supervisor", "Whether the robot is a supervisor.")
    synchronizes = flag_fact(
        "get_synchronization", "Whether the simulation waits for the robot's controller."
    )
    project_path = text_fact(
        "get_project_path", "The folder of the world's project on the simulator's machine."
    )
    custom_data = text_fact(
        "get_custom_data",
        "The robot's field `customData`; a reset of an environment writes the seed to the supervisor's one.",
    )
    control_mode = Fact(
        "get_mode", "get_int", lambda response: RobotMode(response.value), "The robot that is controlled."
    )

    def __init__(self, robot: str) -> None:
        super().__init__(robot, "robot")

    def set_custom_data(self, text: str) -> None:
        """Set the field `customData`, which other robots and the supervisor can read."""
        self._command("set_custom_data", "set_string", value=text)

    def set_control_mode(self, mode: RobotMode, argument: str = "") -> None:
        """Choose the robot that is controlled; the stub and MuJoCo have the simulated robot only.

        Args:
            mode: the mode.
            argument: the argument of the robot's remote control, such as an address.
        """
        self._command("set_mode", "robot_set_mode", mode=int(mode), arg=list(argument.encode()))

    def urdf(self, prefix: str = "") -> str:
        """Return the robot as URDF, whose names begin with `prefix`; the stub and MuJoCo write no URDF."""
        return str(self.call("get_urdf", "get_urdf", prefix=prefix).value)

    def wait_for_input(self, events: InputEvent, timeout_s: float) -> InputEvent:
        """Wait until a person uses mouse, keyboard or joystick in Webots; return the event.

        The stub and MuJoCo have no window, so they return `InputEvent.NONE` at once.

        Args:
            events: the events that end the wait.
            timeout_s: the longest wait in seconds of real time, at most an hour.

        Raises:
            ConfigurationError: the timeout is negative, or longer than an hour.
            SimulatorDead: also if Webots ends during the wait.
        """
        if not 0.0 <= timeout_s <= _LONGEST_WAIT_S:
            raise ConfigurationError(f"a timeout of {timeout_s:g} s; use 0 to {_LONGEST_WAIT_S:g} s")
        name = "wait_for_user_input_event"
        path, type_name = f"/{self.robot}/robot/{name}", f"webots_ros/robot_{name}"
        service = RosService(path, type_name, timeout_s + DEADLINE_S)
        try:
            answer = service(eventType=int(events), timeout=round(timeout_s * _MS_PER_S))
        finally:
            service.close()
        if answer.event < 0:
            raise SimulatorDead(self.robot, "Webots ends")
        return InputEvent(answer.event)

    def send_to_window(self, text: str) -> None:
        """Send a text to the robot's window in Webots; the stub and MuJoCo discard the text."""
        self._command("wwi_send_text", "set_string", value=text)

    def receive_from_window(self) -> str:
        """Return the oldest unread text that the robot's window has sent; "" without one."""
        return str(self.call("wwi_receive_text", "get_string", ask=True).value)

    def send_as_window(self, text: str) -> None:
        """Send a text as the robot's window does, in the stub or MuJoCo.

        Raises:
            WrongData: also if too many texts are unread.
            SimulatorDead: also in Webots, which does not have this service.
        """
        refused = f"the window of {self.robot} has too many unread texts; receive some first"
        self._services.confirm("palaestra/window/send_text", "set_string", refused, value=text)
