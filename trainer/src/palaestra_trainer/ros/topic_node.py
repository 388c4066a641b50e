"""A ROS node for the publishers and subscribers of a program that knows the address of its master.

Such a node is independent of the node of the process (`node`), of ROS_MASTER_URI and of rospy. A process may
have several.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Mapping
from typing import Any, Final
from urllib.parse import urlsplit

from palaestra_protocol.xmlrpc.responses import FAILED, OK
from palaestra_protocol.xmlrpc.server import RpcServer, bind_address, host_name
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.ros import slave_api
from palaestra_trainer.ros.master import Master

_MASTER_S: Final = 2.0  # short, because the robot's master is in the same network


class TopicNode:
    """A node, from its creation to `close`.

    Args:
        name: the full name of the node.
        master_uri: the URI of the master.

    Attributes:
        name: the argument `name`.
        host: the name or address by which other nodes reach this machine.
        uri: the URI at which the node responds.
        master: the node's client of the master.

    Raises:
        ConfigurationError: the node cannot listen on `host`, or `master_uri` cannot be resolved.
    """

    def __init__(self, name: str, master_uri: str) -> None:
        self.name = name
        self.master = Master(name, _MASTER_S, master_uri)
        self._topics: dict[str, tuple[str, int]] = {}
        methods = {
            **slave_api.methods(master_uri, name),
            "getPublications": lambda _: [OK, "", [[topic, kind] for topic, (kind, _) in self._published()]],
            "requestTopic": self._request_topic,
        }
        try:
            self.host = host_toward(master_uri, os.environ)
            self._server = RpcServer((bind_address(self.host), 0), methods.get)
        except OSError as error:
            fact = f"{master_uri}: a ROS node cannot listen: {error.strerror}"
            raise ConfigurationError(f"{fact}; set ROS_IP to the address of this machine") from error
        self.uri = f"http://{self.host}:{self._server.port}/"
        self._server.start()

    def add_publisher(self, topic: str, type_name: str, port: int) -> None:
        """Register a topic, whose subscribers connect to a port of this machine.

        Raises:
            MasterLost: the master does not respond, or refuses the registration.
        """
        self._topics[topic] = (type_name, port)
        self.master.register_publisher(topic, type_name, self.uri)

    def remove_publisher(self, topic: str) -> None:
        """Unregister a topic; further calls have no effect.

        Raises:
            MasterLost: the master does not respond.
        """
        if self._topics.pop(topic, None) is not None:
            self.master.unregister_publisher(topic, self.uri)

    def close(self) -> None:
        """Stop responding, and free the port."""
        self._server.close()

    def _published(self) -> list[tuple[str, tuple[str, int]]]:
        return list(self._topics.items())

    def _request_topic(self, parameters: tuple[Any, ...]) -> list[Any]:
        _, topic, _ = parameters
        if topic not in self._topics:
            return [FAILED, f"this node does not publish {topic}", 0]
        return [OK, "", ["TCPROS", self.host, self._topics[topic][1]]]


def host_toward(uri: str, environment: Mapping[str, str]) -> str:
    """Return ROS_HOSTNAME or ROS_IP; without them, this machine's address in the network of a server.

    rospy would use the name of the machine, which a robot in a network without a name server cannot resolve.

    Raises:
        OSError: the host of `uri` cannot be resolved.
    """
    if environment.get("ROS_HOSTNAME") or environment.get("ROS_IP"):
        return host_name(environment)
    parts = urlsplit(uri)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect((parts.hostname, parts.port))  # sends nothing
        return str(probe.getsockname()[0])
