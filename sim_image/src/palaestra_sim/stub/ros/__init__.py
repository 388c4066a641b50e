"""The ROS side of the stub: nodes that a client cannot tell from roscpp's, in one loop.

rospy gives one node to a process and a thread to each connection; a stub has a node a robot and one hot path.
So the stub speaks the wire itself: XML-RPC with the master (`master`), connections (`links`), one selector
loop for everything that moves (`loop`), and names, services and topics on top (`node`).
"""

from palaestra_sim.stub.ros.loop import Loop
from palaestra_sim.stub.ros.master import MasterUnreachable
from palaestra_sim.stub.ros.node import LATER, RosNode, ServiceFailed
from palaestra_sim.stub.ros.topics import Publisher

__all__ = ["LATER", "Loop", "MasterUnreachable", "Publisher", "RosNode", "ServiceFailed"]
