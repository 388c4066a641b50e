"""The XML-RPC side of a node: its calls to the ROS master, and the slave API that other nodes call.

Source: http://wiki.ros.org/ROS/Master_API and http://wiki.ros.org/ROS/Slave_API
The slave API runs in a separate thread, because it is used rarely, and passes all work to the loop.
"""

from __future__ import annotations

import http.client
import os
import socket
import threading
import xmlrpc.client
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from socketserver import ThreadingMixIn
from typing import Any, Protocol
from xmlrpc.server import SimpleXMLRPCRequestHandler, SimpleXMLRPCServer

_OK = 1
_FAILED = 0
_TIMEOUT_S = 5.0
_POLL_S = 0.05  # interval at which the server checks for `close`


class MasterUnreachable(ConnectionError):
    """The ROS master does not respond at its address."""


class _Transport(xmlrpc.client.Transport):
    """Keeps one connection, and gives up on a master that does not respond."""

    _kept: http.client.HTTPConnection | None = None

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        if self._kept is None:
            self._kept = http.client.HTTPConnection(host, timeout=_TIMEOUT_S)
            self._connection = host, self._kept  # the base class closes the connection in this attribute
        return self._kept

    def close(self) -> None:
        """Close the connection; the next call opens another."""
        super().close()
        self._kept = None


class Master:
    """The ROS master, for the calls of one node.

    Args:
        uri: its address, e.g. http://localhost:11311
        node: the full name of the calling node, e.g. /robotino
    """

    def __init__(self, uri: str, node: str) -> None:
        self._uri = uri
        self._node = node
        self._proxy = xmlrpc.client.ServerProxy(uri, transport=_Transport())
        self._gathered: list[tuple[str, tuple[Any, ...]]] | None = None

    def call(self, method: str, *arguments: Any) -> Any:
        """Return the value of a call in the node's name.

        Raises:
            MasterUnreachable: no response, or an invalid one.
        """
        return self._checked(method, self._sent(method, self._node, *arguments))

    def tell(self, method: str, *arguments: Any) -> None:
        """Make a call whose value is not needed: at once, or with others at the end of `together`.

        Raises:
            MasterUnreachable: as `call`.
        """
        if self._gathered is None:
            self.call(method, *arguments)
        else:
            self._gathered.append((method, arguments))

    @contextmanager
    def together(self) -> Iterator[None]:
        """Send all `tell` calls of the block in one request: a robot has hundreds of services.

        If the master has no `system.multicall`, the calls are sent one after another. If the block raises an
        error, nothing is sent.

        Raises:
            MasterUnreachable: as `call`.
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
            self._checked(method, answer[0] if isinstance(answer, list) else [_FAILED, str(answer), 0])

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
        if code != _OK:
            raise MasterUnreachable(f"the ROS master refused {method}: {text}")
        return value

    def close(self) -> None:
        """Close the connection to the master."""
        self._proxy("close")()


class _RequestHandler(SimpleXMLRPCRequestHandler):
    rpc_paths = ()  # any path, as roscpp
    timeout = _TIMEOUT_S


class _Server(ThreadingMixIn, SimpleXMLRPCServer):
    daemon_threads = True


class Bus(Protocol):
    """The topics of a node and their subscribers; called from another thread."""

    def publications(self) -> list[list[str]]:
        """Return the name and type of each topic."""
        ...

    def connections(self) -> list[list[Any]]:
        """Return an entry of `getBusInfo` for each subscriber that is connected."""
        ...


class SlaveApi:
    """Serves requests of the master, subscribers and tools for one node.

    Args:
        host: the name under which others reach this machine.
        bus: the topics that the node publishes, and their subscribers.
        tcpros_port: the port of the node's TCPROS listener.
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
        self._server = _Server((bind_address(host), 0), _RequestHandler, logRequests=False, allow_none=True)
        for name, answer in self._answers().items():
            self._server.register_function(answer, name)
        self.uri = f"http://{host}:{self._server.server_address[1]}/"
        self._thread = threading.Thread(target=self._server.serve_forever, args=(_POLL_S,), daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop serving requests and free the port."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join(_TIMEOUT_S)

    def _answers(self) -> dict[str, Callable[..., list[Any]]]:
        return {
            "requestTopic": self._request_topic,
            "getPid": lambda _caller: [_OK, "", os.getpid()],
            "getMasterUri": lambda _caller: [_OK, "", self._master_uri],
            "getBusStats": lambda _caller: [_OK, "", [[], [], []]],
            "getBusInfo": lambda _caller: [_OK, "", self._bus.connections()],
            "getSubscriptions": lambda _caller: [_OK, "", []],
            "getPublications": lambda _caller: [_OK, "", self._bus.publications()],
            "publisherUpdate": lambda _caller, _topic, _publishers: [_OK, "", 0],
            "paramUpdate": lambda _caller, _key, _value: [_OK, "", 0],
            "shutdown": self._shutdown,
        }

    def _request_topic(self, _caller: str, topic: str, _protocols: list[Any]) -> list[Any]:
        if all(topic != name for name, _ in self._bus.publications()):
            return [_FAILED, f"this node does not publish {topic}", 0]
        return [_OK, "", ["TCPROS", self._host, self._port]]

    def _shutdown(self, _caller: str, reason: str = "") -> list[Any]:
        self._on_shutdown(reason)
        return [_OK, "", 0]


def host_name() -> str:
    """Return the name for other nodes, by the rules of ROS: ROS_HOSTNAME, ROS_IP, the host's name."""
    return os.environ.get("ROS_HOSTNAME") or os.environ.get("ROS_IP") or socket.gethostname()


def bind_address(host: str) -> str:
    """Return the address to listen on: loopback if `host` is loopback, else every interface."""
    return "127.0.0.1" if host in {"localhost", "127.0.0.1"} else ""
