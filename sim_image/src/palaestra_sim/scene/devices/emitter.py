"""Emitter: sends packets by radio; receivers on its channel get a packet after the next basic step."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final

from palaestra_sim.ros_interfaces import Fields, Handler, Row
from palaestra_sim.scene.devices.device_type import DevicePart, DeviceType
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.old_axes import pointing

EVERYWHERE: Final = -1  # as a range: without limit; as a channel: to or from all channels


@dataclass(slots=True, kw_only=True, eq=False)
class Emitter:
    """An emitter.

    Attributes:
        range_m: the maximum distance of receivers in meters; -1 means without limit.
        channel: the channel of the packets; -1 means all receivers.
        outbox: the texts to send, each with the channel and the range at the time of `send`.
    """

    name: str
    model: str
    place: Frame
    buffer_size: int
    channel: int
    range_m: float
    max_range_m: float
    outbox: list[tuple[str, int, float]] = field(default_factory=list)

    def send(self, text: str) -> None:
        """Queue a packet; drop it if the buffer has no room for it, as in Webots."""
        waiting = sum(len(packet.encode()) for packet, _, _ in self.outbox)
        if self.buffer_size == EVERYWHERE or waiting + len(text.encode()) <= self.buffer_size:
            self.outbox.append((text, self.channel, self.range_m))

    def set_range(self, range_m: float) -> None:
        """Set the range, at most the limit; -1 means the limit, and other negative values are ignored."""
        if range_m == EVERYWHERE:
            self.range_m = self.max_range_m
        elif range_m >= 0.0:
            limit = math.inf if self.max_range_m == EVERYWHERE else self.max_range_m
            self.range_m = min(range_m, limit)

    def set_channel(self, channel: int) -> None:
        """Set the channel; a channel below -1 is ignored."""
        if channel >= EVERYWHERE:
            self.channel = channel


def require_radio(part: DevicePart) -> None:
    """Record a device that is not of the type "radio" as unsupported."""
    medium = part.text("type", "radio")
    if medium != "radio":
        part.lack(f"the type {medium!r} of {part.node.type_name}")


def _read(part: DevicePart) -> Emitter:
    require_radio(part)
    return Emitter(
        name=part.name,
        model=part.text("model"),
        place=pointing(part.node, part.place),
        buffer_size=int(part.number("bufferSize", -1.0)),
        channel=int(part.number("channel", 0.0)),
        range_m=part.number("range", -1.0),
        max_range_m=part.number("maxRange", -1.0),
    )


def _services(emitter: Emitter) -> tuple[Row, ...]:
    return (
        ("send", "set_string", _setter(emitter.send)),
        ("set_channel", "set_int", _setter(emitter.set_channel)),
        ("set_range", "set_float", _setter(emitter.set_range)),
        ("get_channel", "get_int", lambda _: {"value": emitter.channel}),
        ("get_range", "get_float", lambda _: {"value": emitter.range_m}),
        ("get_buffer_size", "get_int", lambda _: {"value": emitter.buffer_size}),
    )


def _setter(command: Callable[[Any], None]) -> Handler:
    """Return a handler that returns success even if the value is ignored, as the controller does."""

    def handle(request: Any) -> Fields:
        command(request.value)
        return {"success": True}

    return handle


EMITTER: Final = DeviceType(
    node="Emitter",
    name="emitter",
    without_effect="aperture baudRate byteSize allowedChannels",
    fields="""type SFString radio; range SFFloat -1; maxRange SFFloat -1; aperture SFFloat -1;
        channel SFInt32 0; baudRate SFInt32 -1; byteSize SFInt32 8; bufferSize SFInt32 -1;
        allowedChannels MFInt32""",
    read=_read,
    services=_services,
)
