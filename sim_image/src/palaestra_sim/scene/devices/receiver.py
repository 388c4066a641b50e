"""Receiver: the queue of the packets that emitters sent on the receiver's channel while it was enabled."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

from palaestra_sim.ros_interfaces import Fields, Row
from palaestra_sim.scene.devices.device_type import DevicePart, DeviceTopic, DeviceType
from palaestra_sim.scene.devices.emitter import EVERYWHERE, require_radio
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Vector
from palaestra_sim.scene.old_axes import pointing


class Packet(NamedTuple):
    """A text, its strength (1 / distance squared), and the unit vector to the emitter.

    The vector is in the frame of the receiver.
    """

    text: str
    strength: float
    direction: Vector


@dataclass(slots=True, kw_only=True, eq=False)
class Receiver:
    """A receiver.

    Attributes:
        listening: whether the receiver is enabled; otherwise it receives nothing.
        channel: the channel on which the receiver listens; -1 means all channels.
        queue: the packets that arrived, the oldest first.
    """

    name: str
    model: str
    place: Frame
    buffer_size: int
    channel: int
    listening: bool = False
    queue: deque[Packet] = field(default_factory=deque)

    @property
    def value(self) -> str:
        """The text of the oldest packet; "" if the queue is empty."""
        return self.queue[0].text if self.queue else ""

    def take(self, packet: Packet) -> None:
        """Queue a packet; drop it if the buffer has no room for it, as in Webots."""
        held = sum(len(waiting.text.encode()) for waiting in self.queue)
        if self.buffer_size == EVERYWHERE or held + len(packet.text.encode()) <= self.buffer_size:
            self.queue.append(packet)

    def listen(self, period_ms: int) -> None:
        """Start to listen; if the period is 0, stop and drop the queue."""
        self.listening = period_ms > 0
        if not self.listening:
            self.queue.clear()


def _read(part: DevicePart) -> Receiver:
    require_radio(part)
    return Receiver(
        name=part.name,
        model=part.text("model"),
        place=pointing(part.node, part.place),
        buffer_size=int(part.number("bufferSize", -1.0)),
        channel=int(part.number("channel", 0.0)),
    )


def _services(receiver: Receiver) -> tuple[Row, ...]:
    queue = receiver.queue

    def set_channel(request: Any) -> Fields:
        receiver.channel = max(EVERYWHERE, request.value)
        return {"success": True}

    def next_packet(_request: Any) -> Fields:
        waiting = bool(queue)
        if waiting:
            queue.popleft()
        return {"value": waiting}

    return (
        ("set_channel", "set_int", set_channel),
        ("get_channel", "get_int", lambda _: {"value": receiver.channel}),
        ("get_queue_length", "get_int", lambda _: {"value": len(queue)}),
        ("next_packet", "get_bool", next_packet),
        ("get_data_size", "get_int", lambda _: {"value": len(receiver.value.encode()) if queue else -1}),
        ("get_signal_strength", "get_float", lambda _: {"value": queue[0].strength if queue else -1.0}),
        ("get_emitter_direction", "receiver_get_emitter_direction", lambda _: _direction(receiver)),
    )


def _direction(receiver: Receiver) -> Fields:
    queue = receiver.queue
    return {"direction": list(queue[0].direction) if queue else [0.0, 0.0, 0.0]}


def _topics(receiver: Receiver) -> tuple[DeviceTopic, ...]:
    return (DeviceTopic(name="data", type_name="webots_ros/StringStamped", source=receiver, reading="data"),)


RECEIVER: Final = DeviceType(
    node="Receiver",
    name="receiver",
    without_effect="aperture baudRate byteSize signalStrengthNoise directionNoise allowedChannels",
    fields="""type SFString radio; aperture SFFloat -1; channel SFInt32 0; baudRate SFInt32 -1;
        byteSize SFInt32 8; bufferSize SFInt32 -1; signalStrengthNoise SFFloat 0;
        directionNoise SFFloat 0; allowedChannels MFInt32""",
    read=_read,
    services=_services,
    topics=_topics,
    enabled=Receiver.listen,
)
