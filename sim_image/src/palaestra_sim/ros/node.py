"""A ROS node: services, published topics and subscriptions, under one name.

The controller of a robot uses this interface. The handler of a service gets the decoded request and returns
the fields of the response. A handler may return `LATER` instead; the controller then calls `answer` when the
response is ready. The handler of a step returns `LATER` while the step waits for another robot or for the end
of a pause.
"""

from __future__ import annotations

import contextlib
import os
import socket
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from typing import Any, Final

from palaestra_protocol.ros.rostypes import ServiceType, message_type, service_type
from palaestra_protocol.ros.shutdown import means_another_node
from palaestra_protocol.ros.tcpros import encode_header, frame
from palaestra_protocol.ros.topic_headers import HeaderRefused, agreed_md5, publisher_header
from palaestra_protocol.xmlrpc.server import bind_address, host_name
from palaestra_sim.ros.links import Connection, Endpoint, Lingering, RosLink
from palaestra_sim.ros.loop import Loop
from palaestra_sim.ros.master import Master, MasterUnreachable, SlaveApi
from palaestra_sim.ros.subscriber import Heard, Subscription
from palaestra_sim.ros.topics import PublishedTopic, Publisher

LATER: Final = object()
Handler = Callable[[Any], Any]

_BACKLOG = 128


class ServiceFailed(Exception):
    """The service cannot return a response; the client gets the text as a ServiceException."""


class RosNode:
    """One node with its services and topics, registered at the master from `start` to `close`.

    Args:
        loop: the event loop of the node's sockets.
        name: the node's name and the prefix of its relative paths, e.g. "robotino".
        master_uri: the URI of the ROS master, e.g. http://localhost:11311
    """

    def __init__(self, loop: Loop, name: str, master_uri: str) -> None:
        self.name = name
        self.blocked: Callable[[], bool] = lambda: False
        self.current_call: object | None = None
        self._loop = loop
        self._ended: Callable[[str], None] = lambda _reason: self.abandon()
        self._master = Master(master_uri, f"/{name}")
        self._services: dict[str, tuple[ServiceType, Handler]] = {}
        self._topics: dict[str, PublishedTopic] = {}
        self._subscriptions: dict[str, Subscription] = {}
        self._links: set[RosLink] = set()
        self._lingering = Lingering(loop)
        self._subscribers: dict[Connection, list[Any]] = {}  # the entries that getBusInfo returns
        self._connected = 0
        self._waiting: deque[tuple[ServiceEnd, bytes]] = deque()
        host = host_name(os.environ)
        self._listener = socket.create_server((bind_address(host), 0), backlog=_BACKLOG)
        self._listener.setblocking(False)
        port = self._listener.getsockname()[1]
        self._rosrpc = f"rosrpc://{host}:{port}"
        self._slave = SlaveApi(host, master_uri, port, self, self._asked_to_end)
        loop.watch(self._listener, self._accept)

    def resolve(self, path: str) -> str:
        """Return the global name of `path`, which is relative to the node unless it begins with a slash."""
        return path if path.startswith("/") else f"/{self.name}/{path}"

    def serve(self, path: str, type_name: str, handler: Handler) -> None:
        """Serve a service; register it at once, or inside a `together` block at the end of the block.

        Raises:
            MasterUnreachable: the master did not accept the registration.
        """
        name = self.resolve(path)
        self._services[name] = (service_type(type_name), handler)
        self._master.tell("registerService", name, self._rosrpc, self._slave.uri)

    def together(self) -> AbstractContextManager[None]:
        """Register the services and topics of a block in one request; see `Master.together`."""
        return self._master.together()

    def advertise(
        self,
        path: str,
        type_name: str,
        *,
        latched: bool = False,
        template: Mapping[str, Any] | None = None,
        reading: str = "",
    ) -> Publisher:
        """Return a new publisher of a topic; all publishers of one topic share its subscribers.

        Args:
            path: the path of the topic: relative to the node, or global with a leading slash.
            type_name: the message type, e.g. sensor_msgs/Range
            latched: whether a late subscriber gets the last message.
            template: the constant fields, for `Publisher.send_value`.
            reading: the field with the sensor's value, which faults change; "" means the last field.
        """
        name = self.resolve(path)
        topic = self._topics.get(name)
        if topic is None:
            topic = self._topics[name] = PublishedTopic(
                name, message_type(type_name), latched=latched, reading=reading
            )
            self._master.tell("registerPublisher", name, type_name, self._slave.uri)
        topic.publishers += 1
        return Publisher(topic, dict(template or {}))

    def withdraw(self, publisher: Publisher) -> None:
        """Remove one publisher; after the last one, close the topic."""
        topic = publisher.topic
        topic.publishers -= 1
        if topic.publishers == 0:
            del self._topics[topic.name]
            self._master.tell("unregisterPublisher", topic.name, self._slave.uri)
            for link in list(topic.links):
                link.close()

    def subscribe(self, path: str, type_name: str, heard: Heard) -> None:
        """Subscribe to a topic, once; call `heard` with each message of each publisher.

        Raises:
            MasterUnreachable: the master did not accept the registration.
        """
        name = self.resolve(path)
        subscription = Subscription(self._loop, f"/{self.name}", name, message_type(type_name), heard)
        self._subscriptions[name] = subscription
        publishers = self._master.call("registerSubscriber", name, type_name, self._slave.uri)
        # The loop handles an update of the master after this call, so an update is newer than `publishers`.
        subscription.set_publishers(publishers)

    def set_parameter(self, path: str, value: Any) -> None:
        """Set a parameter at the master, where other programs read it.

        Raises:
            MasterUnreachable: the master did not accept the parameter.
        """
        self._master.tell("setParam", self.resolve(path), value)

    def answer(self, call: object, fields: Mapping[str, Any]) -> None:
        """Send the response to a call whose handler returned LATER; then handle the waiting requests."""
        if isinstance(call, ServiceEnd):
            call.answer(fields)
        self._loop.later(0, self.take_waiting)

    def later(self, delay_s: float, callback: Callable[[], None]) -> None:
        """Call `callback` after `delay_s` seconds; 0 means after the response to the current call."""
        self._loop.later(delay_s, callback)

    def take_waiting(self) -> None:
        """Handle the requests that arrived while the controller was blocked, in their order."""
        while self._waiting and not self.blocked():
            end, payload = self._waiting.popleft()
            end.handle(payload)

    def request(self, end: ServiceEnd, payload: bytes) -> None:
        """Handle a request; while a step blocks the controller, the request waits."""
        if self.blocked():
            self._waiting.append((end, payload))
        else:
            end.handle(payload)

    def close(self) -> None:
        """Unregister all names, like a controller that exits normally, and close every socket."""
        self.unregister()
        self.abandon()

    def unregister(self) -> None:
        """Unregister every service, topic and subscription at the master; connections stay open."""
        # A master that does not run has no names to unregister.
        with contextlib.suppress(MasterUnreachable), self._master.together():
            for name in self._services:
                self._master.tell("unregisterService", name, self._rosrpc)
            for name in self._topics:
                self._master.tell("unregisterPublisher", name, self._slave.uri)
            for name in self._subscriptions:
                self._master.tell("unregisterSubscriber", name, self._slave.uri)

    def abandon(self) -> None:
        """Close every socket without unregistering, like a controller that was killed."""
        self._loop.forget(self._listener)
        self._listener.close()
        for link in list(self._links):
            link.close()
        for subscription in self._subscriptions.values():
            subscription.close()
        self._slave.close()
        self._master.close()

    def check_master(self) -> None:
        """Check that the master responds.

        Raises:
            MasterUnreachable: the master does not respond.
        """
        self._master.call("getPid")

    def publications(self) -> list[list[str]]:
        """Return the name and type of each published topic, for `getPublications`."""
        return [[topic.name, topic.type.name] for topic in tuple(self._topics.values())]

    def subscriptions(self) -> list[list[str]]:
        """Return the name and type of each topic to which this node subscribes, for `getSubscriptions`."""
        return [[one.topic, one.type.name] for one in tuple(self._subscriptions.values())]

    def connections(self) -> list[list[Any]]:
        """Return number, peer, direction, transport and topic of each connection, for `getBusInfo`."""
        subscriptions = tuple(self._subscriptions.values())
        publishers = [(uri, one.topic) for one in subscriptions for uri in one.connected]
        incoming = [
            [number, uri, "i", "TCPROS", topic, True]
            for number, (uri, topic) in enumerate(publishers, self._connected + 1)
        ]
        return [*self._subscribers.values(), *incoming]

    def publishers_changed(self, topic: str, uris: list[str]) -> None:
        """Connect to the publishers of a topic; `uris` are their current URIs."""
        subscription = self._subscriptions.get(topic)
        if subscription is not None:
            self._loop.post(lambda: subscription.set_publishers(uris))

    def on_end(self, callback: Callable[[str], None]) -> None:
        """Set the function to call when another program requests the end of this node.

        The argument of the function is the reason. `rosnode kill` sends such a request. The master sends such
        a request when another node registers the same name.
        """
        self._ended = callback

    def _asked_to_end(self, reason: str) -> None:
        if means_another_node(reason, f"/{self.name}"):
            return
        self._loop.post(lambda: self._ended(reason))

    def _accept(self) -> None:
        try:
            connection, _ = self._listener.accept()
        except OSError:
            return  # the peer has disconnected already
        self._links.add(RosLink(self._loop, connection, self._greet, self._lingering, self._links.discard))

    def _greet(self, link: Connection, header: Mapping[str, str]) -> Endpoint:
        if "service" in header:
            return self._greet_client(link, header)
        return self._greet_subscriber(link, header)

    def _greet_client(self, link: Connection, header: Mapping[str, str]) -> Endpoint:
        known = self._services.get(header["service"])
        if known is None:
            raise HeaderRefused(f"this node has no service {header['service']}")
        service, handler = known
        md5 = agreed_md5(header, service.name, service.md5, service.later_md5)
        link.send(
            encode_header(
                {
                    "callerid": f"/{self.name}",
                    "md5sum": md5,
                    "request_type": f"{service.name}Request",
                    "response_type": f"{service.name}Response",
                    "type": service.name,
                }
            )
        )
        return ServiceEnd(self, link, service, handler, persistent=header.get("persistent") == "1")

    def _greet_subscriber(self, link: Connection, header: Mapping[str, str]) -> Endpoint:
        topic = self._topics.get(header.get("topic", ""))
        if topic is None:
            raise HeaderRefused(f"this node has no topic {header.get('topic')}")
        ours = publisher_header(f"/{self.name}", topic.name, topic.type, header, latched=topic.latched)
        link.send(encode_header(ours))
        self._connected += 1
        caller = header.get("callerid", "")
        self._subscribers[link] = [self._connected, caller, "o", "TCPROS", topic.name, True]
        return topic.connect(link, self._subscribers.pop)


class ServiceEnd:
    """The server's end of one client's connection to one service."""

    __slots__ = ("_handler", "_link", "_node", "_persistent", "_service")

    def __init__(
        self, node: RosNode, link: Connection, service: ServiceType, handler: Handler, *, persistent: bool
    ) -> None:
        self._node = node
        self._link = link
        self._service = service
        self._handler = handler
        self._persistent = persistent

    def receive(self, payload: bytes) -> None:
        """Handle a request from the connection, or let it wait; see `RosNode.request`."""
        self._node.request(self, payload)

    def handle(self, payload: bytes) -> None:
        """Call the handler of a request and send its response, unless the handler returns LATER."""
        self._node.current_call = self
        try:
            fields = self._handler(self._service.request.decode(payload))
        except (ServiceFailed, ValueError) as error:
            self._send(b"\0" + frame(str(error).encode()))
            return
        if fields is not LATER:
            self.answer(fields)

    def answer(self, fields: Mapping[str, Any]) -> None:
        """Send the response to the last request."""
        self._send(b"\1" + self._service.response.frame(fields))

    def lost(self) -> None:
        """Do nothing: a later response is dropped, because the connection is closed."""

    def _send(self, data: bytes) -> None:
        self._link.send(data)
        if not self._persistent:
            self._link.finish()
