"""The topics that a node publishes, their subscribers, and the messages to these subscribers."""

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
        name: the global name of the topic.
        type: the message type.
        latched: whether a late subscriber gets the last message.
        links: the connections of the subscribers.
        publishers: number of publishers that share the topic.
        reading: the field with the sensor's value; "" means the last field.
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
        """Add a subscriber; if the topic is latched, send the last message to the subscriber.

        Args:
            link: the connection of the subscriber.
            dropped: called with the connection after the subscriber has disconnected.
        """
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
    """The publisher's end of one subscriber's connection; it only waits until the subscriber disconnects."""

    __slots__ = ("_dropped", "_link", "_topic")

    def __init__(
        self, topic: PublishedTopic, link: Connection, dropped: Callable[[Connection], object]
    ) -> None:
        self._topic = topic
        self._link = link
        self._dropped = dropped

    def receive(self, payload: bytes) -> None:
        """Ignore the data: a subscriber has nothing to send after its header."""

    def lost(self) -> None:
        self._topic.links.remove(self._link)
        self._dropped(self._link)


class Publisher:
    """Sends messages to the current subscribers of a topic, with queue size 1."""

    __slots__ = ("_frame", "_pack", "_reading_at", "_sequence", "_template", "topic")

    def __init__(self, topic: PublishedTopic, template: dict[str, Any]) -> None:
        self.topic = topic
        self._template = template
        self._sequence = 0
        # The first call of `send_value` sets these three attributes.
        self._frame = bytearray()
        self._reading_at = 0
        self._pack: _Pack = _STAMP.pack_into

    @property
    def heard(self) -> bool:
        """Whether the topic has a subscriber."""
        return bool(self.topic.links)

    def send(self, fields: Mapping[str, Any]) -> None:
        """Send the template with `fields` in place of the template's own fields."""
        self.topic.send(self.topic.type.codec.frame({**self._template, **fields}))

    def send_value(self, value: Any, stamp_ns: int | None = None) -> None:
        """Send the template with `value` in its last field, a time stamp, and the next sequence number.

        If the topic has no subscriber, this method does nothing; the sequence number does not increase.

        Args:
            value: the value of the last field; a tuple if the field has several numbers.
            stamp_ns: the time in the header, in nanoseconds; the wall clock by default.
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
        """Send the template with `fields` in place of its own fields; the wall clock is the time stamp.

        If the topic has no subscriber, this method does nothing; the sequence number does not increase.
        """
        if not self.topic.links:
            return
        self._sequence += 1
        seconds, nanoseconds = divmod(time.time_ns(), 1_000_000_000)
        stamp = {"seq": self._sequence, "stamp": {"secs": seconds, "nsecs": nanoseconds}}
        self.send({**fields, "header": {**self._template.get("header", {}), **stamp}})

    def _prepare(self) -> None:
        """Encode the template to a frame once, and find the offset of its last field."""
        type_ = self.topic.type
        reading = last_field(type_.name)
        if reading is None:
            raise TypeError(f"{type_.name} does not end with numbers; use `send`")
        self._frame += type_.codec.frame(self._template)
        self._reading_at = len(self._frame) - reading.size
        self._pack = reading.pack_into if len(reading.format) == _ONE_NUMBER else _pack_tuple(reading)


def _pack_tuple(layout: struct.Struct) -> _Pack:
    """Return a function like `layout.pack_into` that takes the numbers as one tuple."""

    def pack(data: bytearray, at: int, values: tuple[float, ...]) -> None:
        layout.pack_into(data, at, *values)

    return pack
