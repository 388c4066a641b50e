"""The ROS master, asked with a deadline; rosgraph's own client would wait for ever."""

from __future__ import annotations

import http.client
import os
import xmlrpc.client
from typing import Any
from urllib.parse import urlsplit

from palaestra_trainer.errors import MasterLost

DEFAULT_URI = "http://localhost:11311"
_TIMEOUT_S = 5.0
_OK = 1


class Deadline(xmlrpc.client.Transport):
    """HTTP for one XML-RPC call that ends after `timeout_s` seconds."""

    def __init__(self, timeout_s: float) -> None:
        super().__init__()
        self._timeout_s = timeout_s

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        """Return a connection whose reads and writes end in time."""
        connection = http.client.HTTPConnection(host, timeout=self._timeout_s)
        self._connection = host, connection  # where the base class looks for what to close
        return connection


class Master:
    """The master at ROS_MASTER_URI, asked in the name of `caller`."""

    def __init__(self, caller: str, timeout_s: float = _TIMEOUT_S) -> None:
        self.uri = os.environ.get("ROS_MASTER_URI", DEFAULT_URI)
        self._caller = caller
        self._timeout_s = timeout_s

    def ping(self) -> None:
        """Return if the master answers.

        Raises:
            MasterLost: it does not.
        """
        self._call("getPid")

    def service_address(self, service: str) -> tuple[str, int] | None:
        """Return host and port of the node that serves `service`; None when no node does."""
        uri = self._ask("lookupService", service)
        if uri is None:
            return None
        parts = urlsplit(uri)
        return str(parts.hostname), int(parts.port or 0)

    def register_subscriber(self, topic: str, type_name: str, node_uri: str) -> list[str]:
        """Register this node as a subscriber and return the addresses of the topic's publishers."""
        return list(self._call("registerSubscriber", topic, type_name, node_uri))

    def unregister_subscriber(self, topic: str, node_uri: str) -> None:
        """Take a registration back."""
        self._call("unregisterSubscriber", topic, node_uri)

    def node_names(self) -> set[str]:
        """Return the full names of all nodes that publish, subscribe or serve."""
        state = self._call("getSystemState")
        return {node for part in state for _, nodes in part for node in nodes}

    def _call(self, method: str, *arguments: Any) -> Any:
        code, text, value = self._answer(method, *arguments)
        if code != _OK:
            raise MasterLost(f"the ROS master refused {method}: {text}")
        return value

    def _ask(self, method: str, *arguments: Any) -> Any | None:
        code, _, value = self._answer(method, *arguments)
        return value if code == _OK else None

    def _answer(self, method: str, *arguments: Any) -> Any:
        try:
            with xmlrpc.client.ServerProxy(self.uri, transport=Deadline(self._timeout_s)) as proxy:
                return getattr(proxy, method)(self._caller, *arguments)
        except (OSError, http.client.HTTPException, xmlrpc.client.Error) as error:
            raise MasterLost(f"no ROS master answers at {self.uri} ({error}); is it running?") from error
