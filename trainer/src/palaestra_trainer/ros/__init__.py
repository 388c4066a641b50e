"""Layer 1: the only place that speaks ROS.

rospy is the node: its name, its registration, what notebooks expect. What is hot goes past it, because a
thread a topic and a proxy without deadline cost more than the simulation: `RosService` and `RosSubscriber`
hold one persistent connection each, wait with a deadline, are rebuilt after a failure, and tell dead, hung
and wrong data apart. One thread uses the services and subscribers of one simulator.
"""

from palaestra_trainer.ros.master import Master
from palaestra_trainer.ros.node import ensure_node
from palaestra_trainer.ros.service import RosService, call_together
from palaestra_trainer.ros.subscriber import RosSubscriber

__all__ = ["Master", "RosService", "RosSubscriber", "call_together", "ensure_node"]
