"""The ROS node of this process: rospy's node if rospy is installed, otherwise our own.

A process has only one node. A user's program may create its node by rospy, with its own publishers and
services. So the trainer uses rospy if it can be imported.
"""

from __future__ import annotations

try:
    from palaestra_trainer.ros.rospy_node import ensure_node, node_uri
except ImportError:  # rospy, or a package that it needs, is missing
    from palaestra_trainer.ros.own_node import ensure_node, node_uri

__all__ = ["ensure_node", "node_uri"]
