"""Publish a ROS topic: each message is sent at once, and no subscriber can delay another or the caller."""

from __future__ import annotations

import contextlib
import socket
import socketserver
import time
from threading import Condition
from typing import Any, Final, cast

from palaestra_protocol.connection_limits import ConnectionSlots
from palaestra_protocol.ros import sockets
from palaestra_protocol.ros.rostypes import message_type
from palaestra_protocol.ros.tcpros import FrameReader, FramingError, decode_header, encode_header
from palaestra_protocol.ros.topic_headers import HeaderRefused, publisher_header
from palaestra_protocol.tcp_server import TcpServer
from palaestra_protocol.xmlrpc.server import bind_address
from palaestra_trainer.errors import MasterLost, UnreadableAnswer
from palaestra_trainer.ros.known_types import known_type
from palaestra_trainer.ros.topic_node import TopicNode

_HEADER_S: Final = 5.0
_MOST_HEADER_BYTES: Final = 1 << 16
# Commands that wait in the kernel reach the robot late. So the kernel's buffer is small, and a connection
# with unconfirmed data is closed soon.
_BUFFER_BYTES: Final = 1 << 14
_UNCONFIRMED_MS: Final = 1000


class RosPublisher:
    """One topic, registered from its creation to `close`; any thread may publish.

    A subscriber is dropped if it reads so slowly that the kernel's buffer is full, or if its machine does not
    confirm a message within a second. It may connect again.

    Args:
        node: the publishing node.
        topic: the full name of the topic.
        type_name: the type of the messages, e.g. geometry_msgs/Twist; for short messages only.

    Raises:
        ConfigurationError: the type is not known.
        MasterLost: the master does not respond, or refuses the registration.
        OSError: this machine has no free port.
    """

    def __init__(self, node: TopicNode, topic: str, type_name: str) -> None:
        self._node = node
        self._topic = topic
        self._type = known_type(message_type, type_name)
        self._changed = Condition()
        self._subscribers: dict[socket.socket, str] = {}  # the names of the nodes, as their headers have them
        self._server = _Server((bind_address(node.host), 0), self)
        self._server.start()
        try:
            node.add_publisher(topic, type_name, self._server.port)
        except (MasterLost, UnreadableAnswer):
            self._server.close()
            raise

    @property
    def subscribers(self) -> frozenset[str]:
        """The full names of the nodes that are connected."""
        with self._changed:
            return frozenset(self._subscribers.values())

    def publish(self, **fields: Any) -> int:
        """Send a message to all connected subscribers, and return their number.

        Raises:
            ValueError: a value does not fit its field.
        """
        data = self._type.codec.frame(fields)
        with self._changed:
            for connection in list(self._subscribers):
                if not _sent(connection, data):
                    self._drop(connection)
            return len(self._subscribers)

    def wait_for_subscriber(self, timeout_s: float, node: str | None = None) -> bool:
        """Wait until the node with this full name is connected; None stands for any node.

        Returns:
            False after the timeout.
        """

        def connected() -> bool:
            return node in self._subscribers.values() or (node is None and bool(self._subscribers))

        with self._changed:
            return self._changed.wait_for(connected, timeout_s)

    def close(self) -> None:
        """Unregister the topic, and close the connections; further calls have no effect."""
        # If the master does not respond, no other node can read the registration.
        with contextlib.suppress(MasterLost, UnreadableAnswer):
            self._node.remove_publisher(self._topic)
        self._server.close()

    def serve(self, connection: socket.socket, slots: ConnectionSlots) -> None:
        """Serve one connection until its end; the server calls this method in a thread of the connection.

        Raises:
            OSError: the connection was lost, or the peer sent no header in time.
        """
        try:
            theirs = _header(connection)
            ours = publisher_header(self._node.name, self._topic, self._type, theirs)
        except (HeaderRefused, FramingError) as error:
            connection.sendall(encode_header({"error": str(error)}))
            return
        for option in (*sockets.OPTIONS, *_OPTIONS):
            connection.setsockopt(*option)
        connection.settimeout(None)
        connection.sendall(encode_header(ours))
        slots.answering(connection, now=True)  # so a new connection cannot take the slot of a subscriber
        with self._changed:
            self._subscribers[connection] = theirs.get("callerid", "")
            self._changed.notify_all()
        try:
            while connection.recv(sockets.FIRST_BYTES):
                pass  # a subscriber has nothing to send after its header
        finally:
            with self._changed:
                self._drop(connection)

    def _drop(self, connection: socket.socket) -> None:
        """Remove the subscriber of a connection, if any, and end its thread, which closes the connection."""
        if connection in self._subscribers:
            del self._subscribers[connection]
            with contextlib.suppress(OSError):  # the subscriber may have closed the connection
                connection.shutdown(socket.SHUT_RDWR)


_OPTIONS: Final = (
    (socket.SOL_SOCKET, socket.SO_SNDBUF, _BUFFER_BYTES),
    (socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, _UNCONFIRMED_MS),
)


class _Server(TcpServer):
    """The server of a topic's connections."""

    poll_s = 0.05
    ends_connections = True

    def __init__(self, address: tuple[str, int], publisher: RosPublisher) -> None:
        self.publisher = publisher
        super().__init__(address, _Handler, name="publisher", slots=ConnectionSlots())


class _Handler(socketserver.BaseRequestHandler):
    """Serves one connection."""

    def handle(self) -> None:
        server = cast("_Server", self.server)
        server.publisher.serve(self.request, server.slots)


def _header(connection: socket.socket) -> dict[str, str]:
    """Return the header of a new connection.

    Raises:
        OSError: the peer sent no header in time, or closed the connection.
        FramingError: the peer sent something else.
    """
    ends = time.monotonic() + _HEADER_S
    frames = FrameReader(_MOST_HEADER_BYTES)
    while (left_s := ends - time.monotonic()) > 0.0:
        connection.settimeout(left_s)
        data = connection.recv(sockets.FIRST_BYTES)
        if not data:
            raise ConnectionError("the peer closed the connection")
        for payload in frames.feed(data):
            return decode_header(payload)
    raise TimeoutError("the peer sent no header")


def _sent(connection: socket.socket, data: bytes) -> bool:
    """Send a message without waiting; return whether the kernel took all of it."""
    try:
        return connection.send(data, socket.MSG_DONTWAIT) == len(data)
    except OSError:
        return False
