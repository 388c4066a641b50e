"""Sensors that detect any number of things: the packets of a radio, and the targets of a radar."""

from __future__ import annotations

from typing import NamedTuple

from palaestra_protocol.ros.rostypes import message_type
from palaestra_trainer.errors import SimulatorHung, WrongData
from palaestra_trainer.ros import RosSubscriber
from palaestra_trainer.webots.device import number_fact, whole_fact
from palaestra_trainer.webots.devices import NodeSensor
from palaestra_trainer.webots.message_decoding import INT8, NumberReading, PickedReading

_TARGET = "dddd"  # webots_ros/RadarTarget


class RadarTarget(NamedTuple):
    """One target of a radar.

    Attributes:
        distance_m: distance between the target and the radar.
        received_power_dbm: the power of the target's echo.
        speed_m_s: the speed at which the target moves away; negative if it comes closer.
        azimuth_rad: direction of the target in the horizontal plane of the radar; positive to the right.
    """

    distance_m: float
    received_power_dbm: float
    speed_m_s: float
    azimuth_rad: float


class Radar(NodeSensor):
    """A radar; `value` is a tuple with a `RadarTarget` for each target in range."""

    __slots__ = ("_targets", "_unread")
    nodes = ("Radar",)
    min_range_m = number_fact("get_min_range", "The least distance of a target, in meters.")
    max_range_m = number_fact("get_max_range", "The greatest distance of a target, in meters.")
    field_of_view_rad = number_fact("get_horizontal_fov", "The horizontal field of view, in rad.")
    vertical_field_of_view_rad = number_fact("get_vertical_fov", "The vertical field of view, in rad.")

    def __init__(self, robot: str, device: str) -> None:
        count = NumberReading(device, INT8)
        super().__init__(robot, device, "webots_ros/Int8Stamped", count, "number_of_targets")
        path = f"/{robot}/{self._path}/targets"
        reading = PickedReading(device, _TARGET, range(len(_TARGET)))
        self._targets = RosSubscriber(path, "webots_ros/RadarTarget", reading)
        self._unread = 0  # targets of a measurement whose reading was interrupted

    def enable(self, period_ms: int) -> None:
        """Make the radar publish every `period_ms` of simulated time, and subscribe to its topics.

        Raises:
            WrongData, SimulatorDead, SimulatorHung: as `Sensor.enable`.
        """
        super().enable(period_ms)
        self._targets.connect()
        self._unread = 0

    def read(self) -> bool:
        """Read the targets of the next measurement.

        If no measurement arrives in time, keep the old targets and return False.

        Raises:
            SimulatorDead, WrongData: as `RosSubscriber`.
        """
        try:
            self._value = self._read_targets(self._values.next())
        except SimulatorHung:
            self.late = True
            return False
        return True

    def read_arrived(self) -> bool:
        """Read the last measurement that has already arrived; return False without such a measurement.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: as `RosSubscriber`.
        """
        counts = self._values.arrived()
        for count in counts:
            self._value = self._read_targets(count)
        self.late = not counts
        return not self.late

    def close(self) -> None:
        """Close the connections."""
        super().close()
        self._targets.close()

    def _read_targets(self, count: int) -> tuple[RadarTarget, ...]:
        """Read the targets of one measurement, after the rest of a measurement that was read only in part.

        Raises:
            WrongData: also if the number of targets is negative, because it is too large for its message.
        """
        if count < 0:
            raise WrongData(self.robot, f"{self.device} has over 127 targets; reduce its field of view")
        targets: list[RadarTarget] = []
        interrupted, self._unread = self._unread, self._unread + count
        while self._unread:
            targets.append(RadarTarget(*self._targets.next()))
            self._unread -= 1
        return tuple(targets[interrupted:])


class RadioPacket(NamedTuple):
    """A received text.

    Attributes:
        text: the text that an emitter has sent.
        signal_strength: 1 / square of the emitter's distance in meters, at the time of the emission.
        direction: the direction to the emitter at that time: x, y, z of a unit vector in the receiver's axes.
    """

    text: str
    signal_strength: float
    direction: tuple[float, float, float]


class Receiver(NodeSensor):
    """A receiver of texts that emitters send on the same channel.

    `value` is the text of the oldest packet in the queue, "" if the queue is empty. The simulator publishes
    this text once in each step, so at most one packet can be taken from the queue in each step. A reset
    clears the queue in the stub and in MuJoCo, but not in Webots.

    Properties and methods may raise SimulatorDead, SimulatorHung or WrongData.
    """

    __slots__ = ("_fresh",)
    nodes = ("Receiver",)
    queue_length = whole_fact("get_queue_length", "The number of packets in the queue.")
    channel = whole_fact("get_channel", "The channel; -1 means all channels.")

    def __init__(self, robot: str, device: str) -> None:
        super().__init__(robot, device, "webots_ros/StringStamped", _text, "data")
        self._fresh = False

    def read(self) -> bool:
        """Read the text of the oldest packet; see `Sensor.read`."""
        self._fresh = super().read()
        return self._fresh

    def read_arrived(self) -> bool:
        """Read the text that has already arrived; see `Sensor.read_arrived`."""
        self._fresh = super().read_arrived()
        return self._fresh

    def take(self) -> RadioPacket | None:
        """Remove the oldest packet of the queue and return it.

        Return None if the queue was empty in the last step, or if a packet of this step was already taken.

        Raises:
            WrongData: also if the packet is not a text; the packet is removed.
        """
        if not self._fresh or not self.queue_length:
            return None
        size = int(self._ask("get_data_size", "get_int"))
        if size and not self.value:
            return None  # the packet arrived after the text of this step was published
        x, y, z = self.call("get_emitter_direction", "receiver_get_emitter_direction", ask=True).direction
        strength = float(self._ask("get_signal_strength", "get_float"))
        self._fresh = False
        self._ask("next_packet", "get_bool")
        # Webots also publishes bytes that follow the packet in memory.
        text = self.value.encode()[:size].decode(errors="ignore")
        if len(text.encode()) != size:
            raise WrongData(self.robot, f"{self.device} has received {size} bytes that are not a text")
        return RadioPacket(text, strength, (x, y, z))

    def set_channel(self, channel: int) -> None:
        """Set the channel; -1 receives on all channels.

        Raises:
            WrongData: also if the simulator ignores the channel.
        """
        self._command("set_channel", "set_int", value=channel)
        self._require_kept("channel", channel, self.channel)

    def _ask(self, service: str, type_name: str) -> float:
        answer: float = self.call(service, type_name, ask=True).value
        return answer


def _text(message: bytes | memoryview) -> str:
    """Return the text of a webots_ros/StringStamped."""
    text: str = message_type("webots_ros/StringStamped").codec.decode(message).data
    return text
