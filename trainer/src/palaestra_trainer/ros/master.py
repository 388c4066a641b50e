"""A client of the ROS master, with a deadline for every call."""

from __future__ import annotations

import os
import xmlrpc.client
from typing import Any
from urllib.parse import urlsplit

from palaestra_protocol.xmlrpc import client
from palaestra_protocol.xmlrpc.documents import UnreadableDocument
from palaestra_protocol.xmlrpc.responses import OK, RpcResponse
from palaestra_trainer.errors import MasterLost, UnreadableAnswer
from palaestra_trainer.ros.xmlrpc import call

DEFAULT_URI = "http://localhost:11311"
_TIMEOUT_S = 5.0
_NODE_TIMEOUT_S = 1.0
_PARTS = 3  # of getSystemState: publishers, subscribers, services


class Master:
    """A client of a master; its calls come from the node `caller`.

    Every method except `ping` raises MasterLost if no master responds or the master refuses the request.
    These methods raise UnreadableAnswer if the response of the master is invalid.

    Args:
        caller: the full name of the calling node.
        timeout_s: time limit of each call.
        uri: the URI of the master; None means ROS_MASTER_URI.
    """

    def __init__(self, caller: str, timeout_s: float = _TIMEOUT_S, uri: str | None = None) -> None:
        self.uri = uri or os.environ.get("ROS_MASTER_URI", DEFAULT_URI)
        self._caller = caller
        self._timeout_s = timeout_s

    def ping(self) -> None:
        """Check that the master responds.

        Raises:
            MasterLost: the master does not respond, or another program responds at its address.
        """
        try:
            self._call("getPid")
        except UnreadableAnswer as error:
            raise MasterLost(
                f"no ROS master at {self.uri}: {error}; another program may use this address"
            ) from error

    def service_address(self, service: str) -> tuple[str, int] | None:
        """Return host and port of the node that serves `service`; None if no node serves it."""
        answer = self._answer("lookupService", service)
        if answer.code != OK:
            return None
        try:
            parts = urlsplit(answer.value)
            return str(parts.hostname), int(parts.port or 0)
        except (ValueError, TypeError, AttributeError) as error:
            raise self._unreadable(f"an address of {service}", answer) from error

    def register_subscriber(self, topic: str, type_name: str, node_uri: str) -> list[str]:
        """Register this node as a subscriber and return the addresses of the topic's publishers."""
        answer = self._call("registerSubscriber", topic, type_name, node_uri)
        if isinstance(answer.value, list) and all(isinstance(uri, str) for uri in answer.value):
            return answer.value
        raise self._unreadable(f"the publishers of {topic}", answer)

    def unregister_subscriber(self, topic: str, node_uri: str) -> None:
        """Unregister this node as a subscriber."""
        self._call("unregisterSubscriber", topic, node_uri)

    def register_publisher(self, topic: str, type_name: str, node_uri: str) -> None:
        """Register this node as a publisher."""
        self._call("registerPublisher", topic, type_name, node_uri)

    def unregister_publisher(self, topic: str, node_uri: str) -> None:
        """Unregister this node as a publisher."""
        self._call("unregisterPublisher", topic, node_uri)

    def publishers(self, topic: str) -> set[str]:
        """Return the full names of the nodes that publish a topic."""
        published, _, _ = self._registered()
        return published.get(topic, set())

    def subscribers(self, topic: str) -> set[str]:
        """Return the full names of the nodes that subscribe to a topic."""
        _, subscribed, _ = self._registered()
        return subscribed.get(topic, set())

    def heard_topics(self) -> set[str]:
        """Return the full names of the topics that have a publisher and a subscriber."""
        published, subscribed, _ = self._registered()
        return published.keys() & subscribed.keys()

    def topic_types(self) -> dict[str, str]:
        """Return the type of each topic, by the full name of the topic."""
        answer = self._call("getTopicTypes")
        try:
            return {str(name): str(kind) for name, kind in answer.value}
        except (ValueError, TypeError) as error:
            raise self._unreadable("types of topics", answer) from error

    def services(self) -> set[str]:
        """Return the full names of all services."""
        _, _, served = self._registered()
        return set(served)

    def node_uri(self, node: str) -> str | None:
        """Return the URI of a node with a full name; None if the master does not know it."""
        answer = self._answer("lookupNode", node)
        return str(answer.value) if answer.code == OK else None

    def parameter(self, name: str) -> Any:
        """Return the value of a parameter with a full name; None if it is not set."""
        answer = self._answer("getParam", name)
        return answer.value if answer.code == OK else None

    def node_names(self) -> set[str]:
        """Return the full names of all nodes that publish, subscribe or offer services."""
        return {node for part in self._registered() for nodes in part.values() for node in nodes}

    def runs(self, node: str) -> bool:
        """Return whether a node of that full name runs; a killed node stays registered, but does not run."""
        uri = self.node_uri(node)
        return uri is not None and self._is_node(uri)

    def _registered(self) -> list[dict[str, set[str]]]:
        """Return three dicts: the nodes of each published topic, each subscribed topic, and each service."""
        answer = self._call("getSystemState")
        try:
            parts = [{str(name): set(map(str, nodes)) for name, nodes in part} for part in answer.value]
        except (ValueError, TypeError) as error:
            raise self._unreadable("names of topics, services and nodes", answer) from error
        if len(parts) != _PARTS:
            raise self._unreadable("publishers, subscribers and services", answer)
        return parts

    def _is_node(self, uri: str) -> bool:
        """Return whether a node of this master has that address; another program may have its port."""
        try:
            answer = client.call(uri, _NODE_TIMEOUT_S, "getMasterUri", self._caller)
        except TimeoutError:
            return True  # the node runs, but does not respond
        except (OSError, UnreadableDocument):
            return False
        except xmlrpc.client.Fault:
            return True  # the node runs, but does not have this method
        # Nodes may write the host of the same master in different ways, so only the port is compared.
        return _port(answer[-1] if isinstance(answer, list) and answer else None) in {None, _port(self.uri)}

    def _call(self, method: str, *arguments: Any) -> RpcResponse:
        answer = self._answer(method, *arguments)
        if answer.code != OK:
            raise MasterLost(f"the ROS master refused {method}: {answer.text}")
        return answer

    def _answer(self, method: str, *arguments: Any) -> RpcResponse:
        try:
            return call(self.uri, self._timeout_s, method, self._caller, *arguments)
        except OSError as error:
            raise MasterLost(f"no ROS master responds at {self.uri} ({error}); is it running?") from error

    def _unreadable(self, wanted: str, answer: RpcResponse) -> UnreadableAnswer:
        return UnreadableAnswer(f"the ROS master responded with {answer.value!r} instead of {wanted}")


def _port(uri: object) -> int | None:
    try:
        return urlsplit(str(uri)).port
    except ValueError:
        return None
