"""Topics that a node publishes: the connected subscribers, and the messages that they get."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable, Mapping
from typing import Any

from palaestra_protocol.ros.rostypes import MessageType, last_field
from palaestra_protocol.ros.tcpros import LENGTH
from palaestra_sim.ros.links import Connection, Endpoint

_STAMP = struct.Struct("<III")  # the start of a std_msgs/Header: seq, seconds, nanoseconds
_ONE_NUMBER = len("<d")
_Pack = Callable[[bytearray, int, Any], None]


class PublishedTopic:
    """A published topic and the connections of its subscribers.

    Attributes:
        links: the links of the connected subscribers.
        publishers: number of publishers that share the topic.
        reading: the field of the value; "" for the last one.
    """

    __slots__ = ("_last", "latched", "links", "name", "publishers", "reading", "type")

    def __init__(self, name: str, type_: MessageType, *, latched: bool, reading: str = "") -> None:
        self.name = name
        self.type = type_
        self.latched = latched
        self.reading = reading
        self.links: list[Connection] = []
        self.publishers = 0
        self._last: bytes | None = None

    def connect(self, link: Connection, dropped: Callable[[Connection], object]) -> Endpoint:
        """Add a subscriber; if the topic is latched, send it the last message."""
        self.links.append(link)
        if self._last is not None:
            link.send(self._last)
        return _SubscriberEnd(self, link, dropped)

    def send(self, data: bytes) -> None:
        """Send a framed message to every subscriber."""
        if self.latched:
            self._last = data
        for link in self.links:
            link.send_newest(data)


class _SubscriberEnd:
    """The publisher's end of one subscriber's connection; it only waits for the close."""

    __slots__ = ("_dropped", "_link", "_topic")

    def __init__(
        self, topic: PublishedTopic, link: Connection, dropped: Callable[[Connection], object]
    ) -> None:
        self._topic = topic
        self._link = link
        self._dropped = dropped

    def receive(self, payload: bytes) -> None:
        """Ignore it: a subscriber sends nothing after its header."""

    def lost(self) -> None:
        self._topic.links.remove(self._link)
        self._dropped(self._link)


class Publisher:
    """Sends messages to the subscribers that are connected at that moment, queue size 1."""

    __slots__ = ("_frame", "_pack", "_reading_at", "_sequence", "_template", "topic")

    def __init__(self, topic: PublishedTopic, template: dict[str, Any]) -> None:
        self.topic = topic
        self._template = template
        self._sequence = 0
        # `send_value` makes these at its first call.
        self._frame = bytearray()
        self._reading_at = 0
        self._pack: _Pack = _STAMP.pack_into

    @property
    def heard(self) -> bool:
        """Whether there is a subscriber."""
        return bool(self.topic.links)

    def send(self, fields: Mapping[str, Any]) -> None:
        """Send a message of `fields`, over the template's."""
        self.topic.send(self.topic.type.codec.frame({**self._template, **fields}))

    def send_value(self, value: Any, stamp_ns: int | None = None) -> None:
        """Send a stamped message: the fields of the template, with `value` in the last one.

        Without a subscriber no message is sent or counted.

        Args:
            value: the reading, or a tuple of the numbers of the last field.
            stamp_ns: nanoseconds of the header's time; the wall clock by default.
        """
        if not self.topic.links:
            return
        if not self._frame:
            self._prepare()
        data = self._frame
        self._sequence += 1
        seconds, nanoseconds = divmod(time.time_ns() if stamp_ns is None else stamp_ns, 1_000_000_000)
        _STAMP.pack_into(data, LENGTH.size, self._sequence, seconds, nanoseconds)
        self._pack(data, self._reading_at, value)
        self.topic.send(bytes(data))

    def send_stamped(self, fields: Mapping[str, Any]) -> None:
        """Send a message with the template's fields, `fields`, and the wall clock in its header.

        Without a subscriber no message is sent or counted.
        """
        if not self.topic.links:
            return
        self._sequence += 1
        seconds, nanoseconds = divmod(time.time_ns(), 1_000_000_000)
        stamp = {"seq": self._sequence, "stamp": {"secs": seconds, "nsecs": nanoseconds}}
        self.send({**fields, "header": {**self._template.get("header", {}), **stamp}})

    def _prepare(self) -> None:
        """Encode the template to a frame once, and find the reading in it."""
        type_ = self.topic.type
        reading = last_field(type_.name)
        if reading is None:
            raise TypeError(f"{type_.name} does not end with numbers; use `send`")
        self._frame += type_.codec.frame(self._template)
        self._reading_at = len(self._frame) - reading.size
        self._pack = reading.pack_into if len(reading.format) == _ONE_NUMBER else _pack_tuple(reading)


def _pack_tuple(layout: struct.Struct) -> _Pack:
    """Return `layout.pack_into` for the numbers of a tuple."""

    def pack(data: bytearray, at: int, values: tuple[float, ...]) -> None:
        layout.pack_into(data, at, *values)

    return pack
