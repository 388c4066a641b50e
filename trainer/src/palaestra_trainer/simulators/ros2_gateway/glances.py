"""Single messages of the topics of ROS 1 that a training reads, each over a connection for one message."""

from __future__ import annotations

import struct
import time
from collections.abc import Iterable, Sequence
from typing import Any, Final

from palaestra_protocol.ros.rostypes import message_type
from palaestra_protocol.ros.topic_headers import subscriber_header
from palaestra_protocol.xmlrpc.responses import address_of
from palaestra_trainer.errors import SimulatorDead, SimulatorFault, UnreadableAnswer, WrongData
from palaestra_trainer.ros.known_types import known_type
from palaestra_trainer.ros.master import Master
from palaestra_trainer.ros.tcpros_client import TcprosClient
from palaestra_trainer.ros.xmlrpc import call

IMAGE: Final = "sensor_msgs/Image"
RANGE: Final = "sensor_msgs/Range"
SCAN: Final = "sensor_msgs/LaserScan"
_KINDS: Final = (IMAGE, RANGE, SCAN)
_DEADLINE_S: Final = 0.5  # short, because a simulator may take no step for seconds while the policy learns
_LOOK_S: Final = 5.0


class WatchedTopics:
    """The images, ranges and laser scans of one robot to which another node subscribes.

    The list is read again every 5 s, because a training enables sensors after the simulator's start.

    Args:
        master: the master of the robot's node.
        caller: the name of this node in the headers of connections; it is not registered.
        robot: the name of the robot's node.
    """

    def __init__(self, master: Master, caller: str, robot: str) -> None:
        self._master = master
        self._caller = caller
        self._robot = robot
        self._types: dict[str, str] = {}
        self._addresses: dict[str, tuple[str, int]] = {}
        self._due_s = 0.0

    def types(self) -> dict[str, str]:
        """Return the type of each topic, by the topic's name without the robot's, such as `ir1/value`.

        Raises:
            MasterLost, UnreadableAnswer: see `Master`; for the next 5 s, calls return the previous list.
        """
        if time.monotonic() >= self._due_s:
            self._due_s = time.monotonic() + _LOOK_S
            above = f"/{self._robot}/"
            types = self._master.topic_types()
            heard = self._master.heard_topics()
            self._types = {
                topic.removeprefix(above): types[topic]
                for topic in sorted(heard)
                if topic.startswith(above) and types.get(topic) in _KINDS
            }
        return self._types

    def next(self, topics: Sequence[str]) -> list[Any]:
        """Return the next message of each topic; all connections are open before the first message is read.

        So the messages come from steps that are close to each other.

        Raises:
            SimulatorFault: a message did not arrive in time, or cannot be read.
        """
        wires: list[TcprosClient] = []
        try:
            wires.extend(self._connected(topic) for topic in topics)
            return [self._decoded(topic, wire) for topic, wire in zip(topics, wires, strict=True)]
        except SimulatorFault:
            self._addresses.clear()  # a simulator that was restarted has other addresses
            raise
        finally:
            _close(wires)

    def _connected(self, topic: str) -> TcprosClient:
        name, kind = f"/{self._robot}/{topic}", known_type(message_type, self._types[topic])
        if topic not in self._addresses:
            self._addresses[topic] = self._address(name)
        header = subscriber_header(self._caller, name, kind)
        return TcprosClient(self._addresses[topic], header, self._robot, _DEADLINE_S)

    def _decoded(self, topic: str, wire: TcprosClient) -> Any:
        codec = known_type(message_type, self._types[topic]).codec
        try:
            return codec.decode(wire.receive())
        except (ValueError, struct.error) as error:
            raise WrongData(self._robot, f"{topic} sent {error}") from error

    def _address(self, topic: str) -> tuple[str, int]:
        """Return the address at which the robot's node publishes a topic."""
        try:
            if (uri := self._master.node_uri(f"/{self._robot}")) is None:
                raise SimulatorDead(self._robot, f"no node publishes {topic}")
            found = call(uri, _DEADLINE_S, "requestTopic", self._caller, topic, [["TCPROS"]])
        except (OSError, UnreadableAnswer) as error:  # MasterLost is an OSError too
            raise SimulatorDead(self._robot, f"{topic} cannot be requested: {error}") from error
        if (address := address_of(found)) is None:
            raise SimulatorDead(self._robot, f"{topic} is not published")
        return address


def _close(wires: Iterable[TcprosClient]) -> None:
    for wire in wires:
        wire.close()
