"""Layer 1: the only package that uses ROS.

The process is a ROS node: rospy's where it is installed, as programs of users expect, otherwise one of our
own (`node`). Calls that are made at each step never use rospy, because its thread per topic and its proxies
without a deadline cost more than the simulation. Instead `RosService` and `RosSubscriber` hold one persistent
connection each. They wait with a deadline, are rebuilt after a failure, and distinguish dead, hung and wrong
data. One thread uses the services and subscribers of one simulator.
"""

from palaestra_trainer.ros.master import Master
from palaestra_trainer.ros.node import ensure_node
from palaestra_trainer.ros.service import RosService, call_together, is_served
from palaestra_trainer.ros.subscriber import RosSubscriber

__all__ = ["Master", "RosService", "RosSubscriber", "call_together", "ensure_node", "is_served"]
