"""The ROS nodes of a simulator; to clients they behave like nodes of roscpp.

rospy allows only one node in a process, and uses a thread for each connection. A simulator needs a node for
each robot, and fast responses. So this package implements the protocols itself:

- `loop`: one event loop for all sockets and timers
- `master`: XML-RPC with the ROS master and with other nodes
- `links`: connections to clients, subscribers and publishers
- `topics`: the topics that a node publishes
- `subscriber`: the topics to which a node subscribes
- `node`: names and services
- `local_socket`: a Unix socket in the same loop, for the sidecar

Simulators of users have such nodes too; docs/howto/bring-a-simulator.md has an example.
"""

from palaestra_sim.ros.local_socket import LocalSocket
from palaestra_sim.ros.loop import Loop
from palaestra_sim.ros.master import MasterUnreachable
from palaestra_sim.ros.node import LATER, RosNode, ServiceFailed
from palaestra_sim.ros.topics import Publisher

__all__ = ["LATER", "LocalSocket", "Loop", "MasterUnreachable", "Publisher", "RosNode", "ServiceFailed"]
