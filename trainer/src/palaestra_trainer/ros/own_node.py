"""This process as a ROS node, without rospy: a name, and an address at which the master and tools reach it.

It registers nothing by itself. `RosSubscriber` registers in its name and connects by itself, so an update of
a topic's publishers needs no action. `rosnode kill` cannot end it: signals end a training in good order.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import structlog

from palaestra_protocol.xmlrpc.responses import FAILED, OK
from palaestra_protocol.xmlrpc.server import Method, RpcServer, bind_address, host_name
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.ros.master import Master

log = structlog.get_logger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Node:
    """The node of this process.

    Attributes:
        name: its full name.
        uri: at which it answers.
        pid: of the process; a fork is another node.
    """

    name: str
    uri: str
    pid: int


_lock = threading.Lock()
_nodes: list[_Node] = []  # one, once there is a node; after a fork also those of the parents


def ensure_node(name: str = "palaestra_trainer") -> str:
    """Return the full name of this process's node; create the node unless there is one already.

    Args:
        name: the node's name; a number is added so that several programs may share a master.

    Raises:
        MasterLost: no master answers.
        ConfigurationError: the process cannot listen.
    """
    return _ensured(name).name


def node_uri() -> str:
    """Return the URI at which this process's node answers other nodes."""
    return _ensured("palaestra_trainer").uri


def _ensured(name: str) -> _Node:
    with _lock:
        if not _nodes or _nodes[-1].pid != os.getpid():
            _nodes.append(_made(name))
        return _nodes[-1]


def _made(name: str) -> _Node:
    namespace = os.environ.get("ROS_NAMESPACE", "").strip("/")
    full_name = f"/{namespace}/{name}_{os.getpid()}" if namespace else f"/{name}_{os.getpid()}"
    master = Master(full_name)
    master.ping()
    host = host_name(os.environ)
    try:
        server = RpcServer((bind_address(host), 0), _answers(master.uri).get)
    except OSError as error:
        fact = f"{host}: cannot listen there as a ROS node: {error.strerror}"
        raise ConfigurationError(f"{fact}; set ROS_HOSTNAME, for example to localhost") from error
    server.start()
    return _Node(name=full_name, uri=f"http://{host}:{server.port}/", pid=os.getpid())


def _answers(master_uri: str) -> dict[str, Method]:
    """Return the calls of the Slave API; the source is http://wiki.ros.org/ROS/Slave_API."""
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
        "shutdown": _asked_to_end,
    }


def _constant(value: Callable[[], Any]) -> Method:
    """Return a call whose value does not depend on its parameters."""
    return lambda _: [OK, "", value()]


def _asked_to_end(parameters: tuple[Any, ...]) -> list[Any]:
    log.warning(
        "the ROS node was asked to end, and continues; send a signal to the process", asked=parameters
    )
    return [OK, "this process ends only at a signal", 0]
