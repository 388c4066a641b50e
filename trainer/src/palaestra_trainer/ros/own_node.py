"""The ROS node of this process without rospy: a name, and an address for the master and for ROS tools.

The node does not register topics or services. `RosSubscriber` registers under the node's name and connects by
itself, so the node ignores updates of a topic's publishers.
"""

from __future__ import annotations

import os
import sys
import threading
from dataclasses import dataclass

from palaestra_protocol.xmlrpc.server import RpcServer, bind_address, host_name
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.ros import slave_api
from palaestra_trainer.ros.master import Master
from palaestra_trainer.ros.node_name import full_name


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
        server = RpcServer((bind_address(host), 0), slave_api.methods(master.uri, in_full).get)
    except OSError as error:
        fact = f"{host}: a ROS node cannot listen on this address: {error.strerror}"
        raise ConfigurationError(f"{fact}; set ROS_HOSTNAME, for example to localhost") from error
    server.start()
    return _Node(name=in_full, uri=f"http://{host}:{server.port}/", pid=os.getpid())
