"""Layer 1 of the trainer, the only package that uses ROS.

The process is a ROS node. If rospy is installed, the node is rospy's, as programs of users expect; otherwise
it is our own (`node`). The calls of each step never use rospy. A thread of rospy per topic costs more time
than the simulation, and its service proxies have no deadline. Instead, `RosService` and `RosSubscriber` hold
one persistent connection each. They wait with a deadline, reconnect after a failure, and distinguish dead,
hung and wrong data. One thread uses the services and subscribers of one simulator.

A program for a real robot names its master itself, and publishes too. So it has a node of its own kind
(`topic_node`), with publishers (`publisher`). All our own nodes serve the methods of `slave_api`. A node of
ROS 2 (`ros2_node`) needs rclpy, which a person's installation of ROS 2 brings; this project does not install
it.

`conformance` calls the services and topics of a running simulator, and compares them with the documented ROS
interface.
"""

from palaestra_trainer.ros.master import Master
from palaestra_trainer.ros.node import ensure_node
from palaestra_trainer.ros.service import RosService, call_together, is_served
from palaestra_trainer.ros.subscriber import RosSubscriber

__all__ = ["Master", "RosService", "RosSubscriber", "call_together", "ensure_node", "is_served"]
