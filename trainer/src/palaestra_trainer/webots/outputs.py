"""Devices of a robot that take commands but measure nothing, such as LEDs, brakes and emitters.

A command takes effect in the next step, as in Webots.
"""

from __future__ import annotations

from typing import Any

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.webots.devices import topic_name
from palaestra_trainer.webots.services import Services


class OutputDevice:
    """A device that takes commands; add it to a simulation like a motor, so that its absence is an error.

    A reset of the simulation restores the device, and no command is repeated.

    Args:
        robot: the ROS name of the robot's controller.
        device: the device's name in the world.

    Attributes:
        robot: see above.
        device: see above.
    """

    __slots__ = ("_path", "_services", "device", "robot")

    def __init__(self, robot: str, device: str) -> None:
        self.robot = robot
        self.device = device
        self._services = Services(robot)
        self._path = topic_name(device)

    def release(self) -> None:
        """Keep the state that the simulator's reset has set."""

    def close(self) -> None:
        """Close the connections."""
        self._services.close()

    def _command(self, name: str, type_name: str, **request: Any) -> None:
        """Call a service of the device that only confirms; see `Services.confirm`."""
        given = ", ".join(f"{field} {value!r}" for field, value in request.items())
        refused = f"{self.device} refuses {name} with {given}"
        self._services.confirm(f"{self._path}/{name}", type_name, refused, **request)

    def _ask(self, name: str, type_name: str) -> Any:
        return self._services.ask(f"{self._path}/{name}", type_name)


class LED(OutputDevice):
    """An LED.

    Every method may raise SimulatorDead, SimulatorHung or WrongData.
    """

    __slots__ = ()

    def set(self, value: int) -> None:
        """Switch the LED: 0 is off; other values are the number of a color, or RGB if the LED is gradual."""
        self._command("set_led", "set_int", value=value)

    @property
    def value(self) -> int:
        """The value that was set last."""
        return int(self._ask("get_led", "get_int"))


class Brake(OutputDevice):
    """The brake of a joint.

    Every method may raise SimulatorDead, SimulatorHung or WrongData.
    """

    __slots__ = ()

    def set_damping(self, constant: float) -> None:
        """Set the damping constant of the joint, in N m s/rad or N s/m; 0 releases the brake.

        Raises:
            ConfigurationError: the constant is negative; Webots would ignore it.
        """
        if constant < 0.0:
            raise ConfigurationError(f"{self.device}: the damping {constant:g} is negative; use 0 or more")
        self._command("set_damping_constant", "set_float", value=constant)


class Pen(OutputDevice):
    """A pen that draws on the floor.

    Every method may raise SimulatorDead, SimulatorHung or WrongData.
    """

    __slots__ = ()

    def write(self, *, on: bool) -> None:
        """Lower the pen if `on`, else lift it."""
        self._command("write", "set_bool", value=on)

    def set_ink(self, rgb: int, density: float) -> None:
        """Set the color of the ink, 0xRRGGBB, and its density, 0 to 1."""
        self._command("set_ink_color", "pen_set_ink_color", color=rgb, density=density)


class Connector(OutputDevice):
    """A connector, which locks to another connector that is near enough.

    Every method may raise SimulatorDead, SimulatorHung or WrongData.
    """

    __slots__ = ()

    def lock(self) -> None:
        """Lock to the connector in front; if the world sets `autoLock`, also to one that comes later."""
        self._command("lock", "set_bool", value=True)

    def unlock(self) -> None:
        """Release the other connector."""
        self._command("lock", "set_bool", value=False)

    @property
    def locked(self) -> bool:
        """Whether the connector is locked, with or without a partner."""
        return bool(self._ask("is_locked", "get_bool"))


class VacuumGripper(OutputDevice):
    """A gripper that holds what it touches while it is on.

    The stub and MuJoCo hold nothing, so they refuse to switch a gripper with a boundingObject on. Every
    method may raise SimulatorDead, SimulatorHung or WrongData.
    """

    __slots__ = ()

    def turn_on(self) -> None:
        """Hold the object that touches the gripper."""
        self._command("turn_on", "set_bool", value=True)

    def turn_off(self) -> None:
        """Release the object."""
        self._command("turn_on", "set_bool", value=False)

    @property
    def on(self) -> bool:
        """Whether the gripper is switched on."""
        return bool(self._ask("is_on", "get_bool"))


class Emitter(OutputDevice):
    """An emitter of texts to receivers on the same channel.

    Every method may raise SimulatorDead, SimulatorHung or WrongData.
    """

    __slots__ = ()

    def send(self, text: str) -> None:
        """Send a text to all receivers in range; as in Webots, a text larger than the buffer is lost."""
        self._command("send", "set_string", value=text)

    def set_channel(self, channel: int) -> None:
        """Set the channel; -1 sends on all channels.

        Raises:
            WrongData: also if the simulator ignores the channel.
        """
        self._command("set_channel", "set_int", value=channel)
        self._services.require_kept(self.device, "channel", channel, self.channel)

    def set_range(self, range_m: float) -> None:
        """Set the range in meters; -1 means without a limit.

        Raises:
            WrongData: also if the range is larger than the emitter's maxRange.
        """
        self._command("set_range", "set_float", value=range_m)
        self._services.require_kept(self.device, "range", range_m, self.range_m)

    @property
    def channel(self) -> int:
        """The channel."""
        return int(self._ask("get_channel", "get_int"))

    @property
    def range_m(self) -> float:
        """The range in meters; -1 means without a limit."""
        return float(self._ask("get_range", "get_float"))

    @property
    def buffer_bytes(self) -> int:
        """The size of the buffer in bytes; -1 means without a limit."""
        return int(self._ask("get_buffer_size", "get_int"))


class Speaker(OutputDevice):
    """A loudspeaker.

    Every method may raise SimulatorDead, SimulatorHung or WrongData.
    """

    __slots__ = ()

    def play(
        self, file: str, *, volume: float = 1.0, pitch: float = 1.0, balance: float = 0.0, loop: bool = False
    ) -> None:
        """Play a sound file, whose path is relative to the controller.

        Args:
            file: the path of the sound file.
            volume: loudness, 0 (silent) to 1.
            pitch: factor of the frequency, above 0.
            balance: -1 (left) to 1 (right).
            loop: whether the sound is repeated until `stop`.
        """
        self._command(
            "play_sound",
            "speaker_play_sound",
            sound=file,
            volume=volume,
            pitch=pitch,
            balance=balance,
            loop=int(loop),
        )

    def stop(self, file: str = "") -> None:
        """Stop a sound file; "" stops all of them."""
        self._command("stop", "set_string", value=file)

    def plays(self, file: str = "") -> bool:
        """Return whether a sound file is playing; for "", whether any sound file is playing."""
        service = self._services.get(f"{self._path}/is_sound_playing", "speaker_is_sound_playing")
        return bool(service(sound=file).value)

    def speak(self, text: str, *, volume: float = 1.0) -> None:
        """Speak a text with a volume from 0 to 1."""
        self._command("speak", "speaker_speak", text=text, volume=volume)

    @property
    def speaking(self) -> bool:
        """Whether the loudspeaker speaks."""
        return bool(self._ask("is_speaking", "get_bool"))
