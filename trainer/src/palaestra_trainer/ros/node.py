"""This process as a ROS node: rospy's where rospy is installed, otherwise one of our own.

A process has one node. A program of a user may have one through rospy, with publishers and services of its
own, so rospy is used wherever it can be imported.
"""

from __future__ import annotations

try:
    from palaestra_trainer.ros.rospy_node import ensure_node, node_uri
except ImportError:  # rospy, or a package that it needs, is missing
    from palaestra_trainer.ros.own_node import ensure_node, node_uri

__all__ = ["ensure_node", "node_uri"]
