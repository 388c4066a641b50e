"""The ROS node of this process without rospy: a name, and an address for the master and for ROS tools.

The node does not register topics or services. `RosSubscriber` registers under the node's name and connects by
itself, so the node ignores updates of a topic's publishers. `rosnode kill` ends the process as SIGTERM does.
The master ends the process in the same way if another node takes the name. A training saves a checkpoint
before it ends.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import structlog

from palaestra_protocol.ros.shutdown import means_another_node
from palaestra_protocol.xmlrpc.responses import FAILED, OK
from palaestra_protocol.xmlrpc.server import Method, RpcServer, bind_address, host_name
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.ros.master import Master
from palaestra_trainer.ros.node_name import full_name

_RESPONDING_S = 0.2  # time to send the response to `shutdown` before the signal

log = structlog.get_logger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Node:
    """A node of this process, or of the process that forked this process.

    Attributes:
        name: full name of the node.
        uri: URI at which the node responds.
        pid: process ID of the process that created the node; a forked process needs another node.
    """

    name: str
    uri: str
    pid: int


_lock = threading.Lock()
_nodes: list[_Node] = []  # the node of this process is last; after a fork, nodes of the parents come first


def ensure_node(name: str = "palaestra_trainer") -> str:
    """Return the full name of this process's node; create the node if it does not exist.

    Args:
        name: the node's name; the process ID is appended, so that several programs may share a master. As
            with rospy, `__name:=` and `__ns:=` among the program's arguments replace the name.

    Raises:
        MasterLost: no master responds.
        ConfigurationError: the process cannot listen, or an argument sets an invalid name.
    """
    return _ensured(name).name


def node_uri() -> str:
    """Return the URI at which this process's node responds to other nodes."""
    return _ensured("palaestra_trainer").uri


def _ensured(name: str) -> _Node:
    with _lock:
        if not _nodes or _nodes[-1].pid != os.getpid():
            _nodes.append(_made(name))
        return _nodes[-1]


def _made(name: str) -> _Node:
    in_full = full_name(f"{name}_{os.getpid()}", sys.argv, os.environ)
    master = Master(in_full)
    master.ping()
    host = host_name(os.environ)
    try:
        server = RpcServer((bind_address(host), 0), _answers(master.uri, in_full).get)
    except OSError as error:
        fact = f"{host}: a ROS node cannot listen on this address: {error.strerror}"
        raise ConfigurationError(f"{fact}; set ROS_HOSTNAME, for example to localhost") from error
    server.start()
    return _Node(name=in_full, uri=f"http://{host}:{server.port}/", pid=os.getpid())


def _answers(master_uri: str, name: str) -> dict[str, Method]:
    """Return the methods of the Slave API; the source is http://wiki.ros.org/ROS/Slave_API."""
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
