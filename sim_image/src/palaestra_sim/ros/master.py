"""The XML-RPC interface of a node: its calls to the ROS master, and the slave API that other nodes call.

The slave API is used rarely, so it runs in a separate thread. This thread passes all work to the event loop.
Source: http://wiki.ros.org/ROS/Master_API and http://wiki.ros.org/ROS/Slave_API
"""

from __future__ import annotations

import http.client
import os
import xmlrpc.client
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Protocol

from palaestra_protocol.xmlrpc.responses import FAILED, OK
from palaestra_protocol.xmlrpc.server import Method, RpcServer, bind_address

_TIMEOUT_S = 5.0


class MasterUnreachable(ConnectionError):
    """The ROS master does not respond at its address."""


class _Transport(xmlrpc.client.Transport):
    """Keeps one connection open, and raises TimeoutError if the master does not respond in time."""

    _kept: http.client.HTTPConnection | None = None

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        if self._kept is None:
            self._kept = http.client.HTTPConnection(host, timeout=_TIMEOUT_S)
            self._connection = host, self._kept  # the base class closes the connection in this attribute
        return self._kept

    def close(self) -> None:
        """Close the connection; the next call opens a new one."""
        super().close()
        self._kept = None


class Master:
    """Calls the ROS master in the name of one node.

    Args:
        uri: the URI of the master, e.g. http://localhost:11311
        node: the full name of the calling node, e.g. /robotino
    """

    def __init__(self, uri: str, node: str) -> None:
        self._uri = uri
        self._node = node
        self._proxy = xmlrpc.client.ServerProxy(uri, transport=_Transport())
        self._gathered: list[tuple[str, tuple[Any, ...]]] | None = None

    def call(self, method: str, *arguments: Any) -> Any:
        """Call a method of the master and return its value.

        Raises:
            MasterUnreachable: the master sent no response or an invalid response, or refused the call.
        """
        return self._checked(method, self._sent(method, self._node, *arguments))

    def tell(self, method: str, *arguments: Any) -> None:
        """Make a call whose value is not needed.

        Inside a `together` block the call is sent at the end of the block, otherwise at once.

        Raises:
            MasterUnreachable: see `call`.
        """
        if self._gathered is None:
            self.call(method, *arguments)
        else:
            self._gathered.append((method, arguments))

    @contextmanager
    def together(self) -> Iterator[None]:
        """Send all `tell` calls of the block in one request.

        One request is much faster, because a robot registers hundreds of services. If the master has no
        `system.multicall`, the calls are sent one after another. If the block raises an error, no call is
        sent.

        Raises:
            MasterUnreachable: see `call`.
        """
        gathered = self._gathered = []
        try:
            yield
        finally:
            self._gathered = None
        if not gathered:
            return
        calls = [{"methodName": method, "params": [self._node, *rest]} for method, rest in gathered]
        try:
            answers = self._sent("system.multicall", calls)
        except MasterUnreachable as error:
            if not isinstance(error.__cause__, xmlrpc.client.Fault):
                raise
            for method, rest in gathered:
                self.call(method, *rest)
            return
        for (method, _), answer in zip(gathered, answers, strict=True):
            self._checked(method, answer[0] if isinstance(answer, list) else [FAILED, str(answer), 0])

    def _sent(self, method: str, *arguments: Any) -> Any:
        try:
            return getattr(self._proxy, method)(*arguments)
        except (OSError, http.client.HTTPException, xmlrpc.client.Error, ValueError) as error:
            raise MasterUnreachable(f"no ROS master at {self._uri}: {error}") from error

    def _checked(self, method: str, answer: Any) -> Any:
        try:
            code, text, value = answer
        except (TypeError, ValueError) as error:
            raise MasterUnreachable(f"no ROS master at {self._uri}: {error}") from error
        if code != OK:
            raise MasterUnreachable(f"the ROS master refused {method}: {text}")
        return value

    def close(self) -> None:
        """Close the connection to the master."""
        self._proxy("close")()


class Bus(Protocol):
    """The topics of a node and their connections; the methods are called from another thread."""

    def publications(self) -> list[list[str]]:
        """Return the name and type of each published topic."""
        ...

    def subscriptions(self) -> list[list[str]]:
        """Return the name and type of each topic to which the node subscribes."""
        ...

    def connections(self) -> list[list[Any]]:
        """Return an entry of `getBusInfo` for each connected subscriber and publisher."""
        ...

    def publishers_changed(self, topic: str, uris: list[str]) -> None:
        """Connect to the publishers of a topic; `uris` are their current URIs."""
        ...


class SlaveApi:
    """Serves the requests that the master, subscribers and tools send to one node.

    Args:
        host: the name under which other nodes reach this machine.
        master_uri: the URI of the master.
        tcpros_port: the port of the node's TCPROS listener.
        bus: the topics of the node, and their connections.
        on_shutdown: called in another thread when the master requests the end of the node.
    """

    def __init__(
        self,
        host: str,
        master_uri: str,
        tcpros_port: int,
        bus: Bus,
        on_shutdown: Callable[[str], None],
    ) -> None:
        self._host = host
        self._master_uri = master_uri
        self._port = tcpros_port
        self._bus = bus
        self._on_shutdown = on_shutdown
        self._methods = self._answers()
        self._server = RpcServer((bind_address(host), 0), self._find)
        self.uri = f"http://{host}:{self._server.port}/"
        self._server.start()

    def close(self) -> None:
        """Stop serving requests and free the port."""
        self._server.close()

    def _find(self, name: str) -> Method | None:
        answer = self._methods.get(name)
        return None if answer is None else lambda parameters: answer(*parameters)

    def _answers(self) -> dict[str, Callable[..., list[Any]]]:
        return {
            "requestTopic": self._request_topic,
            "getPid": lambda _caller: [OK, "", os.getpid()],
            "getMasterUri": lambda _caller: [OK, "", self._master_uri],
            "getBusStats": lambda _caller: [OK, "", [[], [], []]],
            "getBusInfo": lambda _caller: [OK, "", self._bus.connections()],
            "getSubscriptions": lambda _caller: [OK, "", self._bus.subscriptions()],
            "getPublications": lambda _caller: [OK, "", self._bus.publications()],
            "publisherUpdate": self._publisher_update,
            "paramUpdate": lambda _caller, _key, _value: [OK, "", 0],
            "shutdown": self._shutdown,
        }

    def _request_topic(self, _caller: str, topic: str, _protocols: list[Any]) -> list[Any]:
        if all(topic != name for name, _ in self._bus.publications()):
            return [FAILED, f"this node does not publish {topic}", 0]
        return [OK, "", ["TCPROS", self._host, self._port]]

    def _publisher_update(self, _caller: str, topic: str, publishers: list[Any]) -> list[Any]:
        self._bus.publishers_changed(topic, [uri for uri in publishers if isinstance(uri, str)])
        return [OK, "", 0]

    def _shutdown(self, _caller: str, reason: str = "") -> list[Any]:
        self._on_shutdown(reason)
        return [OK, "", 0]
