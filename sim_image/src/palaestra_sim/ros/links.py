"""TCPROS connections: to a client of a service, and to a subscriber or publisher of a topic.

Sockets are non-blocking. Responses to the client of a service are queued without loss. A subscriber that
reads too slowly gets only the newest message, as from a publisher with queue size 1.
"""

from __future__ import annotations

import socket
from collections.abc import Callable, Mapping
from typing import Protocol

from palaestra_protocol.ros import sockets
from palaestra_protocol.ros.tcpros import (
    MAX_FRAME_BYTES,
    FrameReader,
    FramingError,
    decode_header,
    encode_header,
)
from palaestra_protocol.ros.topic_headers import HeaderRefused
from palaestra_sim.ros.loop import Loop

# The node closes a finished connection after one to two times this time. By then roscpp and rospy have closed
# the connection themselves. A client that reads until the end of the stream waits until the node closes it.
LINGER_S = 1.0

# If a client has not read the whole response when its connection is finished, the node closes the connection
# after this time.
SEND_S = 60.0


class Endpoint(Protocol):
    """The receiver of a connection's frames; a node creates it after it has read the connection's header."""

    def receive(self, payload: bytes) -> None:
        """Handle one frame from the peer."""
        ...

    def lost(self) -> None:
        """Handle the end of the connection."""
        ...


class Connection(Protocol):
    """The connection through which an endpoint sends: a `RosLink`, or a wrapper around a `RosLink`."""

    @property
    def closed(self) -> bool:
        """Whether the connection is closed."""
        ...

    def send(self, data: bytes) -> None:
        """Send all of `data`."""
        ...

    def send_newest(self, data: bytes) -> None:
        """Send `data`; while the peer does not read, only the newest data waits to be sent."""
        ...

    def finish(self) -> None:
        """Ignore further requests; close when the peer closes, or some time after all data was sent."""
        ...

    def close(self) -> None:
        """Close the connection; safe to call again."""
        ...


Greet = Callable[["RosLink", Mapping[str, str]], Endpoint]


class Lingering:
    """The finished connections; each is closed between one and two LINGER_S after it was added.

    All of them share one timer. A timer for each connection would be expensive: a client that opens a
    connection for each call may make a thousand calls a second.
    """

    def __init__(self, loop: Loop) -> None:
        self._loop = loop
        self._new: set[RosLink] = set()
        self._old: set[RosLink] = set()

    def add(self, link: RosLink) -> None:
        """Close `link` later."""
        if not (self._new or self._old):
            self._loop.later(LINGER_S, self._close_old)
        self._new.add(link)

    def discard(self, link: RosLink) -> None:
        """Remove `link`, which is already closed."""
        self._new.discard(link)
        self._old.discard(link)

    def _close_old(self) -> None:
        for link in list(self._old):
            link.close()
        self._old, self._new = self._new, set()
        if self._old:
            self._loop.later(LINGER_S, self._close_old)


class RosLink:
    """A connection from accept or connect to close.

    Args:
        loop: the event loop of the socket.
        connection: the connected socket.
        greet: returns the endpoint for the header of the connection.
        lingering: closes the connection some time after `finish`.
        gone: called when the connection is closed, even if its header was not read yet.
        most_bytes: the longest frame of the peer; a longer frame ends the connection.
    """

    __slots__ = (
        "_endpoint",
        "_finished",
        "_frames",
        "_gone",
        "_greet",
        "_lingering",
        "_loop",
        "_newest",
        "_socket",
        "_unsent",
        "closed",
    )

    def __init__(
        self,
        loop: Loop,
        connection: socket.socket,
        greet: Greet,
        lingering: Lingering,
        gone: Callable[[RosLink], None],
        most_bytes: int = MAX_FRAME_BYTES,
    ) -> None:
        connection.setblocking(False)
        for option in sockets.OPTIONS:
            connection.setsockopt(*option)
        self._loop = loop
        self._socket = connection
        self._greet = greet
        self._lingering = lingering
        self._gone = gone
        self._frames = FrameReader(most_bytes)
        self._endpoint: Endpoint | None = None
        self._unsent: bytes | memoryview = b""
        self._newest: bytes | None = None
        self._finished = False
        self.closed = False
        loop.watch(connection, self._ready)

    def send(self, data: bytes) -> None:
        """Send all of `data`, now or as soon as the peer reads."""
        if self._unsent:
            self._unsent = bytes(self._unsent) + data
        else:
            self._write(data)

    def send_newest(self, data: bytes) -> None:
        """Send `data`; while the peer does not read, `data` replaces older data that waits to be sent."""
        if self._unsent:
            self._newest = data
        else:
            self._write(data)

    def finish(self) -> None:
        """Ignore further requests; close when the peer closes, or some time after all data was sent.

        The node must not close at once: roscpp would drop a response that it has not read yet
        (ros/ros_comm#1976). A long response is dropped after SEND_S, because a client that has stopped
        reading would otherwise keep the response in memory.
        """
        if self.closed:
            return
        self._finished = True
        if self._unsent:
            self._loop.later(SEND_S, self.close)
        else:
            self._lingering.add(self)

    def close(self) -> None:
        """Close the connection; safe to call again."""
        if self.closed:
            return
        self.closed = True
        self._lingering.discard(self)
        self._loop.forget(self._socket)
        self._socket.close()
        self._gone(self)
        if self._endpoint is not None:
            self._endpoint.lost()

    def _write(self, data: bytes | memoryview) -> None:
        try:
            sent = self._socket.send(data)
        except BlockingIOError:
            sent = 0
        except OSError:
            self.close()
            return
        if sent < len(data):
            self._unsent = memoryview(data)[sent:]  # no copy, because an image is sent in many parts
            self._loop.watch(self._socket, self._ready, writing=True)
        elif self._unsent:
            self._unsent = b""

    def _flush(self) -> None:
        unsent, self._unsent = self._unsent, b""
        self._write(unsent)
        if not self._unsent and self._newest is not None:
            newest, self._newest = self._newest, None
            self._write(newest)
        if self._unsent or self.closed:
            return
        self._loop.watch(self._socket, self._ready)
        if self._finished:
            self._lingering.add(self)

    def _ready(self) -> None:
        if self._unsent:
            self._flush()
        if self.closed:
            return
        try:
            data = self._socket.recv(sockets.FIRST_BYTES)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self.close()
            return
        self._take(data)

    def _take(self, data: bytes) -> None:
        try:
            for payload in self._frames.feed(data):
                if self._endpoint is None:
                    self._endpoint = self._greet(self, decode_header(payload))
                elif not (self.closed or self._finished):
                    self._endpoint.receive(payload)
        except (HeaderRefused, FramingError) as error:
            self._write(encode_header({"error": str(error)}))
            self.close()
