"""The ROS side of a simulator: nodes that behave like roscpp's to clients, in one loop.

rospy has one node in a process and a thread for each connection, but a simulator has a node for each robot
and one hot path. So it implements the protocols itself: XML-RPC with the master (`master`), connections
(`links`), one selector loop for all sockets (`loop`), topics (`topics`), and names and services (`node`).
Besides ROS, the loop answers a sidecar (`local_socket`).
"""

from palaestra_sim.ros.local_socket import LocalSocket
from palaestra_sim.ros.loop import Loop
from palaestra_sim.ros.master import MasterUnreachable
from palaestra_sim.ros.node import LATER, RosNode, ServiceFailed
from palaestra_sim.ros.topics import Publisher

__all__ = ["LATER", "LocalSocket", "Loop", "MasterUnreachable", "Publisher", "RosNode", "ServiceFailed"]
