"""The methods that a ROS node serves to the master, to other nodes and to ROS tools.

`rosnode kill` ends the process as SIGTERM does. The master ends the process in the same way if another node
takes the name. A training saves a checkpoint before it ends.
Source: http://wiki.ros.org/ROS/Slave_API
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable
from typing import Any

import structlog

from palaestra_protocol.ros.shutdown import means_another_node
from palaestra_protocol.xmlrpc.responses import FAILED, OK
from palaestra_protocol.xmlrpc.server import Method

_RESPONDING_S = 0.2  # time to send the response to `shutdown` before the signal

log = structlog.get_logger(__name__)


def methods(master_uri: str, name: str) -> dict[str, Method]:
    """Return the methods of the node `name`, which publishes no topic and ignores all updates."""
    return {
        "getPid": _constant(os.getpid),
        "getMasterUri": _constant(lambda: master_uri),
        "getBusStats": _constant(lambda: [[], [], []]),
        "getBusInfo": _constant(list),
        "getSubscriptions": _constant(list),
        "getPublications": _constant(list),
        "publisherUpdate": _constant(lambda: 0),
        "paramUpdate": _constant(lambda: 0),
        "requestTopic": lambda _: [FAILED, "this node publishes no topic", 0],
        "shutdown": _Shutdown(name),
    }


def _constant(value: Callable[[], Any]) -> Method:
    """Return a method whose result does not depend on its parameters."""
    return lambda _: [OK, "", value()]


class _Shutdown:
    """The method `shutdown`; its first call for the node `name` ends this process as SIGTERM does."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._first = threading.Lock()

    def __call__(self, parameters: tuple[Any, ...]) -> list[Any]:
        """Return the response, and send the signal a moment later."""
        if any(means_another_node(parameter, self._name) for parameter in parameters[1:]):
            return [FAILED, f"this node is {self._name}", 0]
        if self._first.acquire(blocking=False):  # a second signal would end a training without its checkpoint
            log.warning("the ROS node was asked to end", asked=parameters)
            timer = threading.Timer(_RESPONDING_S, os.kill, (os.getpid(), signal.SIGTERM))
            timer.daemon = True
            timer.start()
        return [OK, "this process ends", 0]
