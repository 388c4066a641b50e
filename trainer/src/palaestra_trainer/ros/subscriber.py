"""Subscribe to a ROS topic, and read its messages on demand."""

from __future__ import annotations

import contextlib
import struct
from collections.abc import Callable
from typing import Any

from palaestra_protocol.ros.rostypes import message_type
from palaestra_protocol.ros.topic_headers import subscriber_header
from palaestra_protocol.xmlrpc.responses import OK, address_of
from palaestra_trainer.errors import (
    MasterLost,
    SimulatorDead,
    SimulatorFault,
    SimulatorHung,
    UnreadableAnswer,
    WrongData,
)
from palaestra_trainer.ros.known_types import known_type, node_of
from palaestra_trainer.ros.master import Master
from palaestra_trainer.ros.node import ensure_node, node_uri
from palaestra_trainer.ros.tcpros_client import TcprosClient
from palaestra_trainer.ros.topic_node import TopicNode
from palaestra_trainer.ros.xmlrpc import call

DEADLINE_S = 0.5
_CONNECT_S = 5.0  # per response of the publisher; longer than a message, because its host may be busy


class RosSubscriber:
    """One topic of one publisher, with a connection that `connect` opens and a failure closes.

    Args:
        name: the full name, e.g. /robotino/ir1/value
        type_name: e.g. sensor_msgs/Range
        decode: returns the value in the bytes of a message; None: the whole message is decoded.
        deadline_s: the longest time to wait for a message; a connection may take longer.
        node: the subscribing node; None: the node of this process.

    Raises:
        ConfigurationError: the name is not a full name, or the type is not known.
    """

    __slots__ = ("_deadline_s", "_decode", "_node", "_registered", "_type", "_wire", "name", "simulator")

    def __init__(
        self,
        name: str,
        type_name: str,
        decode: Callable[[bytes | memoryview], Any] | None = None,
        deadline_s: float = DEADLINE_S,
        node: TopicNode | None = None,
    ) -> None:
        self.name = name
        self.simulator = node_of(name)
        self._type = known_type(message_type, type_name)
        self._decode = decode or self._type.codec.decode
        self._deadline_s = deadline_s
        self._node = node
        self._wire: TcprosClient | None = None
        self._registered = False

    @property
    def connected(self) -> bool:
        """Whether a publisher is connected; messages from before the connection are lost."""
        return self._wire is not None

    def connect(self) -> None:
        """Connect to the publisher, and wait until it has registered this subscriber.

        Raises:
            SimulatorDead: no node publishes the topic, or the publisher cannot be reached.
            SimulatorHung: the publisher does not respond in time.
            WrongData: the master or the publisher sends an invalid response.
        """
        self._drop()
        node, uri, master = self._subscribing()
        try:
            publishers = master.register_subscriber(self.name, self._type.name, uri)
        except UnreadableAnswer as error:
            raise WrongData(self.simulator, f"{self.name} cannot be subscribed to: {error}") from error
        self._registered = True
        if not publishers:
            raise SimulatorDead(self.simulator, f"no node publishes {self.name}")
        address = self._ask_for_address(publishers[-1], node)
        header = subscriber_header(node, self.name, self._type)
        self._wire = TcprosClient(address, header, self.simulator, _CONNECT_S)
        self._wire.wait_at_most(self._deadline_s)
        self._wire.acknowledge_late()

    def next(self) -> Any:
        """Wait for the next message and return its value.

        Raises:
            SimulatorHung: no message arrived within the deadline; the connection stays open.
            SimulatorDead: the connection was lost, or `connect` was never called.
            WrongData: the message cannot be read.
        """
        wire = self._wire or self._connection()
        try:
            return self._decode(wire.receive())
        except SimulatorHung:
            raise
        except SimulatorFault:
            self._drop()
            raise
        except (ValueError, struct.error) as error:
            raise WrongData(self.simulator, f"{self.name} sent {error}") from error

    def arrived(self) -> list[Any]:
        """Return the values of all messages that have arrived and were not read, the oldest first.

        Raises:
            SimulatorDead, WrongData: as `next`.
        """
        values = []
        while self._wire is not None and self._wire.waiting_bytes():
            values.append(self.next())
        return values

    def newest(self, default: Any) -> Any:
        """Return the value of the last message that has arrived; `default` without a new message.

        Raises:
            SimulatorDead, WrongData: as `next`.
        """
        return [default, *self.arrived()][-1]

    def close(self) -> None:
        """Close the connection and unregister the subscriber."""
        self._drop()
        if self._registered:
            self._registered = False
            # If the master does not run, the registration does not exist. A master that sends invalid
            # responses cannot unregister the subscriber.
            with contextlib.suppress(MasterLost, UnreadableAnswer):
                _, uri, master = self._subscribing()
                master.unregister_subscriber(self.name, uri)

    def fileno(self) -> int:
        """Return the descriptor, which becomes readable when a message arrives or the connection is lost.

        Raises:
            SimulatorDead: the subscriber is not connected.
        """
        return self._connection().fileno()

    def _subscribing(self) -> tuple[str, str, Master]:
        """Return the name and the URI of the subscribing node, and its client of the master."""
        if self._node is not None:
            return self._node.name, self._node.uri, self._node.master
        name = ensure_node()
        return name, node_uri(), Master(name)

    def _connection(self) -> TcprosClient:
        if self._wire is None:
            raise SimulatorDead(self.simulator, f"{self.name} is not connected")
        return self._wire

    def _drop(self) -> None:
        if self._wire is not None:
            self._wire.close()
            self._wire = None

    def _ask_for_address(self, publisher: str, node: str) -> tuple[str, int]:
        try:
            answer = call(publisher, _CONNECT_S, "requestTopic", node, self.name, [["TCPROS"]])
        except TimeoutError as error:
            raise SimulatorHung(
                self.simulator, f"{self.name} has a publisher that does not respond"
            ) from error
        except OSError as error:
            fact = f"{self.name} has a publisher that cannot be reached: {error.strerror or error}"
            raise SimulatorDead(self.simulator, fact) from error
        except UnreadableAnswer as error:
            raise WrongData(
                self.simulator, f"{self.name} has a publisher that sends invalid responses: {error}"
            ) from error
        if answer.code != OK:
            raise SimulatorDead(self.simulator, f"{self.name} is not published: {answer.text}")
        if (address := address_of(answer)) is not None:
            return address
        raise WrongData(
            self.simulator, f"{self.name} is published at {answer.value!r}, which is not an address"
        )
