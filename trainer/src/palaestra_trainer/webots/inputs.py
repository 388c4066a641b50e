"""Keyboard and joystick of a robot; every robot has both, without nodes for them in the world.

A pod has no keyboard. So in the stub and in MuJoCo, a program can press keys and move the joystick.
Webots reads the keys of its own window instead.
"""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from typing import Any, ClassVar, NamedTuple

from palaestra_trainer.errors import SimulatorDead, WorldMisfit
from palaestra_trainer.ros import RosSubscriber
from palaestra_trainer.webots.device import flag_fact, text_fact, whole_fact
from palaestra_trainer.webots.devices import Sensor
from palaestra_trainer.webots.message_decoding import INT32, NumberReading

ALL = -1  # releases all keys or buttons


class _Input(Sensor):
    """A device that publishes the keys or buttons that are pressed."""

    __slots__ = ()
    listed: ClassVar[bool] = False

    def __init__(self, robot: str, device: str, type_name: str, codes: str, topic: str) -> None:
        super().__init__(robot, device, type_name, NumberReading(device, codes), topic)

    def read(self) -> bool:
        """Read the messages of the last step.

        The number of messages is unknown, so this method first sends a request. The stub and MuJoCo respond
        to this request only after they have sent the messages of the step. Webots may send the messages
        later; they are then read in the next step.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: as `RosService` and `RosSubscriber`.
        """
        _ = self.sampling_period_ms
        return self.read_arrived()

    def press(self, key: int) -> None:
        """Press a key or button, in the stub or MuJoCo, until it is released.

        Raises:
            WrongData: also if too many keys are pressed.
            SimulatorDead: also in Webots, which does not have this service.
        """
        self._call_ours("press", "set_int", f"{self.device} refuses to press {key}", value=key)

    def release(self, key: int = ALL) -> None:
        """Release a key or button; by default all of them.

        Raises:
            WrongData: also if the key is not pressed.
            SimulatorDead: also in Webots, which does not have this service.
        """
        self._call_ours("release", "set_int", f"{self.device}: {key} is not pressed", value=key)

    def _pressed(self) -> tuple[int, ...]:
        """Return the numbers that arrived, each once, in the order in which they arrived.

        A joystick sends -1 if no button is pressed; this number is left out.
        """
        return tuple(dict.fromkeys(number for number in self._values.arrived() if number >= 0))

    def _call_ours(self, name: str, type_name: str, refused: str, **request: Any) -> None:
        """Call a service that Webots does not have."""
        self._services.confirm(f"palaestra/{self.device}/{name}", type_name, refused, **request)


class Keyboard(_Input):
    """The keyboard; `value` is a tuple of the keys that were pressed in the last step.

    A key is its character code, such as ord("W"), or a number from Webots' manual, such as 315 for the up
    arrow. Shift adds 65536, Ctrl 131072 and Alt 262144 to the number.
    """

    __slots__ = ()

    def __init__(self, robot: str) -> None:
        super().__init__(robot, "keyboard", "webots_ros/Int32Stamped", INT32, "key")

    def read_arrived(self) -> bool:
        """Read the keys that have already arrived.

        Raises:
            SimulatorDead, WrongData: as `RosSubscriber`.
        """
        self._value = self._pressed()
        self.late = False
        return True


class JoystickState(NamedTuple):
    """The state of a joystick.

    Attributes:
        buttons: the number of the button that was pressed in the last step. If several buttons are pressed,
            a simulator sends only the first button.
        axes: the position of each axis, -128 to 127; 0 until a joystick is connected.
        povs: the direction of each hat switch (point of view); 0 until a joystick is connected.
    """

    buttons: tuple[int, ...]
    axes: tuple[int, ...]
    povs: tuple[int, ...]


class Joystick(_Input):
    """A joystick; `value` is a `JoystickState`.

    Args:
        robot: the ROS name of the robot's controller.
        axes: the number of axes to read. The stub and MuJoCo have 6.
        povs: the number of hat switches to read. The stub and MuJoCo have 1.
    """

    __slots__ = ("_axes", "_positions", "_topics")
    connected = flag_fact(
        "is_connected",
        "Whether a joystick is connected; in the stub and MuJoCo, pressing or moving it connects it.",
    )
    model = text_fact("get_model", 'The model of the joystick; "" until one is connected.')
    number_of_axes = whole_fact("get_number_of_axes", "The number of axes; -1 until a joystick is connected.")
    number_of_povs = whole_fact(
        "get_number_of_povs", "The number of hat switches; -1 until a joystick is connected."
    )

    def __init__(self, robot: str, axes: int = 2, povs: int = 0) -> None:
        super().__init__(robot, "joystick", "webots_ros/Int32Stamped", INT32, "pressed_button")
        names = [*(f"axis{at}" for at in range(axes)), *(f"pov{at}" for at in range(povs))]
        self._axes = axes
        self._positions = [0] * len(names)
        self._topics = [
            RosSubscriber(f"/{robot}/joystick/{name}", "webots_ros/Int32Stamped", NumberReading(name, INT32))
            for name in names
        ]

    def enable(self, period_ms: int) -> None:
        """Make the joystick publish every `period_ms` of simulated time, and subscribe to its topics.

        Raises:
            WrongData, SimulatorDead, SimulatorHung: as `Sensor.enable`.
        """
        super().enable(period_ms)
        self._positions = [0] * len(self._topics)
        for topic in self._topics:
            # Webots advertises these topics in the first step in which a joystick is connected.
            with contextlib.suppress(SimulatorDead):
                topic.connect()

    def read(self) -> bool:
        """Read the messages of the last step; see `Keyboard.read`.

        Raises:
            WorldMisfit: the joystick has fewer axes.
            SimulatorDead, SimulatorHung, WrongData: as `RosService` and `RosSubscriber`.
        """
        axes = self._count("axes")
        if 0 <= axes < self._axes:
            raise WorldMisfit(self.robot, f"the joystick has {axes} axes; use Joystick(..., axes={axes})")
        povs = self._count("povs") if len(self._topics) > self._axes else axes
        if 0 <= povs < len(self._topics) - self._axes:
            fact = f"the joystick has {povs} hat switches; use Joystick(..., povs={povs})"
            raise WorldMisfit(self.robot, fact)
        for topic in self._topics:
            if axes >= 0 and not topic.connected:
                topic.connect()
        return self.read_arrived()

    def _count(self, what: str) -> int:
        """Return the number of axes or hat switches, with a connection that stays open for the next step."""
        return int(self.call(f"get_number_of_{what}", "get_int", ask=True).value)

    def read_arrived(self) -> bool:
        """Read the buttons and positions that have already arrived.

        Raises:
            SimulatorDead, WrongData: as `RosSubscriber`.
        """
        for at, topic in enumerate(self._topics):
            self._positions[at] = topic.newest(self._positions[at])
        axes, povs = self._positions[: self._axes], self._positions[self._axes :]
        self._value = JoystickState(self._pressed(), tuple(axes), tuple(povs))
        self.late = False
        return True

    def move(self, axes: Sequence[int] = (), povs: Sequence[int] = ()) -> None:
        """Move the first axes and hat switches to these positions, -128 to 127, in the stub or MuJoCo.

        Raises:
            WrongData: also if there are too many positions, or one of them is out of range.
            SimulatorDead: also in Webots, which does not have these services.
        """
        for name, positions in (("set_axes", axes), ("set_povs", povs)):
            refused = f"{self.device} refuses {name} with {list(positions)}"
            self._call_ours(name, "set_float_array", refused, values=list(positions))

    def push(self, force: int, axis: int = 0, duration_s: float = 0.0) -> None:
        """Push back with a force on an axis of a joystick with force feedback.

        Args:
            force: the level of the force, as the joystick's driver defines it; 0 ends the push.
            axis: the number of the axis.
            duration_s: the duration in seconds; 0 means until the next call.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: as `RosService`.
        """
        self._command("set_force_axis", "set_int", value=axis)
        self._command("set_constant_force_duration", "set_float", value=duration_s)
        self._command("set_constant_force", "set_int", value=force)

    def resist(self, resistance: float, centering: float = 0.0) -> None:
        """Set the gains of a joystick with force feedback.

        Args:
            resistance: the gain against motion.
            centering: the gain toward the center.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: as `RosService`.
        """
        self._command("set_resistance_gain", "set_float", value=resistance)
        self._command("set_auto_centering_gain", "set_float", value=centering)

    def close(self) -> None:
        """Close the connections."""
        super().close()
        for topic in self._topics:
            topic.close()
