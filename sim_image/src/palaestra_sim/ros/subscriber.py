"""The topics to which a node subscribes; a node has a connection to each publisher of such a topic.

The master reports the addresses of the publishers, first as the response to the registration and then after
each change. Each connection is opened in a separate thread, because a publisher may take seconds to respond;
then the event loop reads the open connection. If a connection fails while its publisher is registered, the
next attempt begins after `RETRY_S`.
"""

from __future__ import annotations

import logging
import socket
import xmlrpc.client
from collections.abc import Callable, Iterable, Mapping
from threading import Lock, Thread
from typing import Any, Final

from palaestra_protocol.ros.rostypes import MessageType
from palaestra_protocol.ros.tcpros import encode_header
from palaestra_protocol.ros.topic_headers import check_publisher, subscriber_header
from palaestra_protocol.xmlrpc import client
from palaestra_protocol.xmlrpc.documents import UnreadableDocument
from palaestra_protocol.xmlrpc.responses import address_of, response_of
from palaestra_sim.ros.links import Endpoint, Lingering, RosLink
from palaestra_sim.ros.loop import Loop

CONNECT_S: Final = 5.0  # time limit of the request for a publisher's address, and of the connection to it
RETRY_S: Final = 1.0
MOST_BYTES: Final = 1 << 20  # the longest message; commands of robots have a few hundred bytes

log = logging.getLogger(__name__)

Heard = Callable[[Any], None]
"""Takes a decoded message; called in the thread of the event loop."""


class Subscription:
    """A topic to which a node subscribes; only the event loop's thread calls the methods.

    Args:
        loop: the event loop of the connections.
        caller: the full name of the subscribing node.
        topic: the full name of the topic.
        type_: the type of the messages.
        heard: called for each message, in the order of arrival.

    Attributes:
        topic: the argument `topic`.
        type: the argument `type_`.
    """

    def __init__(self, loop: Loop, caller: str, topic: str, type_: MessageType, heard: Heard) -> None:
        self.topic = topic
        self.type = type_
        self._loop = loop
        self._caller = caller
        self._heard = heard
        self._lingering = Lingering(loop)
        self._publishers: frozenset[str] = frozenset()
        self._links: dict[str, RosLink] = {}
        self._accepted: dict[str, None] = {}  # a set in the order of acceptance
        self._connecting: set[str] = set()
        self._closed = False
        self._closing = Lock()  # after `close`, the loop may be closed too, so no thread may post to it

    @property
    def connected(self) -> tuple[str, ...]:
        """The URIs of the publishers that have accepted a connection; any thread may read them."""
        return tuple(self._accepted)

    def set_publishers(self, uris: Iterable[str]) -> None:
        """Connect to the nodes with these URIs, and close the connections to all others."""
        self._publishers = frozenset() if self._closed else frozenset(uris)
        for uri in self._links.keys() - self._publishers:
            self._links[uri].close()
        for uri in self._publishers:
            self._connect(uri)

    def close(self) -> None:
        """Close all connections, for good."""
        with self._closing:
            self._closed = True
        self.set_publishers(())

    def _connect(self, uri: str) -> None:
        if uri in self._publishers and uri not in self._links and uri not in self._connecting:
            self._connecting.add(uri)
            Thread(target=self._dial, args=(uri,), name=f"connect-{self.topic}", daemon=True).start()

    def _dial(self, uri: str) -> None:
        """Connect to a publisher; runs in a separate thread."""
        try:
            connection = _connected(uri, self._caller, self.topic)
        except (OSError, UnreadableDocument, xmlrpc.client.Fault) as error:
            log.debug("%s: no connection to %s: %s", self.topic, uri, error)
            connection = None
        with self._closing:
            if not self._closed:
                self._loop.post(lambda: self._dialed(uri, connection))
            elif connection is not None:
                connection.close()

    def _dialed(self, uri: str, connection: socket.socket | None) -> None:
        self._connecting.discard(uri)
        if connection is None:
            self._loop.later(RETRY_S, lambda: self._connect(uri))
        elif uri not in self._publishers:
            connection.close()
        else:
            link = RosLink(
                self._loop,
                connection,
                lambda _, header: self._greet(uri, header),
                self._lingering,
                lambda _: self._gone(uri),
                MOST_BYTES,
            )
            self._links[uri] = link
            link.send(encode_header(subscriber_header(self._caller, self.topic, self.type)))

    def _gone(self, uri: str) -> None:
        self._links.pop(uri, None)
        self._accepted.pop(uri, None)
        if not self._closed:
            self._loop.later(RETRY_S, lambda: self._connect(uri))

    def _greet(self, uri: str, header: Mapping[str, str]) -> Endpoint:
        check_publisher(header, self.type)
        self._accepted[uri] = None
        return _PublisherEnd(self.topic, self.type, self._heard)


class _PublisherEnd:
    """The subscriber's end of the connection to one publisher."""

    __slots__ = ("_heard", "_topic", "_type")

    def __init__(self, topic: str, type_: MessageType, heard: Heard) -> None:
        self._topic = topic
        self._type = type_
        self._heard = heard

    def receive(self, payload: bytes) -> None:
        """Decode a message, and pass it on; a message that cannot be decoded is logged."""
        try:
            message = self._type.codec.decode(payload)
        except ValueError as error:
            log.warning("%s: a message is not a %s: %s", self._topic, self._type.name, error)
            return
        self._heard(message)

    def lost(self) -> None:
        """Do nothing: the subscription itself connects again."""


def _connected(uri: str, caller: str, topic: str) -> socket.socket:
    """Return a connection to the publisher of a topic.

    Raises:
        OSError: the publisher does not respond in time, or does not publish the topic.
        UnreadableDocument, xmlrpc.client.Fault: the publisher sent an invalid response, or an error.
    """
    response = response_of(client.call(uri, CONNECT_S, "requestTopic", caller, topic, [["TCPROS"]]))
    if response is None or (address := address_of(response)) is None:
        raise ConnectionError(f"the node responded with {response!r} instead of an address")
    return socket.create_connection(address, timeout=CONNECT_S)
