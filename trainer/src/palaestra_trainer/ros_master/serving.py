"""Serve the master on a port; calls arrive in several threads, and a lock orders them."""

from __future__ import annotations

import os
import threading
from types import TracebackType
from typing import Any, Self

from palaestra_protocol.xmlrpc.server import Method, RpcServer
from palaestra_trainer.ros_master.api import MasterApi, Update
from palaestra_trainer.ros_master.updates import Updates


class MasterServer:
    """A ROS master that responds from `start` until `close`.

    Args:
        host: the address on which the master listens.
        port: the port; 0 takes a free port.
        name: the host name by which nodes reach the master; by default `host`.

    Raises:
        OSError: the port is in use, or the machine does not have this address.
    """

    def __init__(self, host: str = "127.0.0.1", port: int = 0, name: str = "") -> None:
        self._server = RpcServer((host, port), self._find)
        self.uri = f"http://{name or host}:{self._server.port}/"
        self._lock = threading.Lock()
        self._api = MasterApi(self.uri, os.getpid())
        self._updates = Updates(self._stop_updates)

    def start(self) -> Self:
        """Begin to respond to calls, in new threads."""
        self._server.start()
        return self

    def close(self) -> None:
        """Stop responding and free the port, without waiting for updates that are being sent."""
        self._server.close()

    def __enter__(self) -> Self:
        """Begin to respond to calls."""
        return self.start()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Stop responding."""
        self.close()

    def _find(self, method: str) -> Method | None:
        if not self._api.knows(method):
            return None
        return lambda arguments: self._called(method, arguments)

    def _called(self, method: str, arguments: tuple[Any, ...]) -> Any:
        with self._lock:
            response, updates = self._api.call(method, arguments)
            if updates:
                self._updates.add(updates)  # in the lock, to keep the order of updates
        return tuple(response)  # XML-RPC has no named tuples

    def _stop_updates(self, update: Update) -> None:
        with self._lock:
            self._api.stop_updates(update)
