"""Devices of a robot that take commands but measure nothing, such as LEDs, brakes and emitters.

A command takes effect in the next step, as in Webots.
"""

from __future__ import annotations

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.webots.device import (
    JointDevice,
    NodeDevice,
    flag_fact,
    number_fact,
    text_fact,
    whole_fact,
)
from palaestra_trainer.webots.devices import NodeSensor
from palaestra_trainer.webots.message_decoding import BOOL, INT8, NumberReading


class OutputDevice(NodeDevice):
    """A device that takes commands; add it to a simulation like a motor, so that its absence is an error.

    A reset of the simulation restores the device, and no command is repeated.
    """

    __slots__ = ()

    def release(self) -> None:
        """Keep the state that the simulator's reset has set."""


class LED(OutputDevice):
    """An LED.

    Every method may raise SimulatorDead, SimulatorHung or WrongData.
    """

    __slots__ = ()
    nodes = ("LED",)
    value = whole_fact("get_led", "The value that was set last.")

    def set(self, value: int) -> None:
        """Switch the LED: 0 is off; other values are the number of a color, or RGB if the LED is gradual."""
        self._command("set_led", "set_int", value=value)


class Brake(OutputDevice, JointDevice):
    """The brake of a joint.

    Every method may raise SimulatorDead, SimulatorHung or WrongData.
    """

    __slots__ = ()
    nodes = ("Brake",)
    motor_name = text_fact("get_motor_name", 'The name of the motor on the same joint; "" without a motor.')
    position_sensor_name = text_fact(
        "get_position_sensor_name", 'The name of the position sensor on the same joint; "" without one.'
    )

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
    nodes = ("Pen",)

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
    nodes = ("Connector",)
    locked = flag_fact("is_locked", "Whether the connector is locked, with or without a partner.")

    def lock(self) -> None:
        """Lock to the connector in front; with `autoLock` in the world, also to one that arrives later."""
        self._command("lock", "set_bool", value=True)

    def unlock(self) -> None:
        """Release the other connector."""
        self._command("lock", "set_bool", value=False)


class ConnectorPresence(NodeSensor):
    """The sensor in a connector; `value` is 1 if another connector can be locked, else 0.

    A passive connector cannot detect another connector; its `value` is -1.
    """

    __slots__ = ()
    nodes = ("Connector",)

    def __init__(self, robot: str, device: str) -> None:
        reading = NumberReading(device, INT8)
        super().__init__(
            robot, device, "webots_ros/Int8Stamped", reading, "presence", "presence_sensor/enable"
        )


class VacuumGripper(OutputDevice):
    """A gripper that, while it is switched on, holds the object that touches it.

    The stub and MuJoCo do not simulate this, so they refuse to switch on a gripper with a boundingObject.
    Every method may raise SimulatorDead, SimulatorHung or WrongData.
    """

    __slots__ = ()
    nodes = ("VacuumGripper",)
    on = flag_fact("is_on", "Whether the gripper is switched on.")

    def turn_on(self) -> None:
        """Hold the object that touches the gripper."""
        self._command("turn_on", "set_bool", value=True)

    def turn_off(self) -> None:
        """Release the object."""
        self._command("turn_on", "set_bool", value=False)


class VacuumPresence(NodeSensor):
    """The sensor in a vacuum gripper; `value` is True if an object is in reach."""

    __slots__ = ()
    nodes = ("VacuumGripper",)

    def __init__(self, robot: str, device: str) -> None:
        reading = NumberReading(device, BOOL)
        super().__init__(
            robot, device, "webots_ros/BoolStamped", reading, "presence", "presence_sensor/enable"
        )


class Emitter(OutputDevice):
    """An emitter of texts to receivers on the same channel.

    Every method may raise SimulatorDead, SimulatorHung or WrongData.
    """

    __slots__ = ()
    nodes = ("Emitter",)
    channel = whole_fact("get_channel", "The channel.")
    range_m = number_fact("get_range", "The range in meters; -1 means without a limit.")
    buffer_bytes = whole_fact("get_buffer_size", "The size of the buffer in bytes; -1 means without a limit.")

    def send(self, text: str) -> None:
        """Send a text to all receivers in range; as in Webots, a text larger than the buffer is lost."""
        self._command("send", "set_string", value=text)

    def set_channel(self, channel: int) -> None:
        """Set the channel; -1 sends on all channels.

        Raises:
            WrongData: also if the simulator ignores the channel.
        """
        self._command("set_channel", "set_int", value=channel)
        self._require_kept("channel", channel, self.channel)

    def set_range(self, range_m: float) -> None:
        """Set the range in meters; -1 means no limit.

        Raises:
            WrongData: also if the range is larger than the emitter's maxRange.
        """
        self._command("set_range", "set_float", value=range_m)
        self._require_kept("range", range_m, self.range_m)


class Speaker(OutputDevice):
    """A loudspeaker.

    Every method may raise SimulatorDead, SimulatorHung or WrongData.
    """

    __slots__ = ()
    nodes = ("Speaker",)
    engine = text_fact("get_engine", 'The program that speaks: "pico" or "microsoft".')
    language = text_fact("get_language", 'The language in which it speaks, such as "en-US".')
    speaking = flag_fact("is_speaking", "Whether the loudspeaker speaks.")

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
        return bool(self.call("is_sound_playing", "speaker_is_sound_playing", sound=file).value)

    def set_engine(self, engine: str) -> None:
        """Choose the program that speaks: "pico" or "microsoft".

        Raises:
            WrongData: also if the simulator does not know the program.
        """
        self._command("set_engine", "set_string", value=engine)

    def set_language(self, language: str) -> None:
        """Choose the language, such as "en-US".

        Raises:
            WrongData: also if the program that speaks does not know the language.
        """
        self._command("set_language", "set_string", value=language)

    def speak(self, text: str, *, volume: float = 1.0) -> None:
        """Speak a text with a volume from 0 to 1."""
        self._command("speak", "speaker_speak", text=text, volume=volume)
