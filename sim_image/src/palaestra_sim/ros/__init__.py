"""The ROS side of the stub: nodes that behave like roscpp's to clients, in one loop.

rospy has one node in a process and a thread for each connection, but a stub has a node for each robot and one
hot path. So the stub implements the protocols itself: XML-RPC with the master (`master`), connections
(`links`), one selector loop for all sockets (`loop`), and names, services and topics (`node`).
"""

from palaestra_sim.ros.loop import Loop
from palaestra_sim.ros.master import MasterUnreachable
from palaestra_sim.ros.node import LATER, RosNode, ServiceFailed
from palaestra_sim.ros.topics import Publisher

__all__ = ["LATER", "Loop", "MasterUnreachable", "Publisher", "RosNode", "ServiceFailed"]
