"""Layer 1: the only package that uses ROS.

rospy provides the node: its name, its registration, and the interface that notebooks expect. Calls at each
step do not use rospy, because its thread per topic and its proxies without a deadline cost more than the
simulation. Instead `RosService` and `RosSubscriber` hold one persistent connection each. They wait with a
deadline, connect again after a failure, and distinguish dead, hung and wrong data. Only one thread may use
the services and subscribers of one simulator.
"""

from palaestra_trainer.ros.master import Master
from palaestra_trainer.ros.node import ensure_node
from palaestra_trainer.ros.service import RosService, call_together
from palaestra_trainer.ros.subscriber import RosSubscriber

__all__ = ["Master", "RosService", "RosSubscriber", "call_together", "ensure_node"]
