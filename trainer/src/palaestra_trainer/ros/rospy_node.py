"""The ROS node of this process by rospy; this module needs an installed rospy."""

from __future__ import annotations

import os
import threading

import rospy
import rospy.core

from palaestra_trainer.ros.master import Master

_lock = threading.Lock()


def ensure_node(name: str = "palaestra_trainer") -> str:
    """Return the full name of this process's node; create the node if it does not exist.

    Args:
        name: the node's name; the process ID is appended, so that several programs may share a master.

    Raises:
        MasterLost: no master responds; rospy alone would wait forever.
    """
    with _lock:
        if not rospy.core.is_initialized():
            Master(f"/{name}").ping()
            # The program uses its own signal handlers, clock and log. rospy only registers the node with its
            # name.
            rospy.init_node(
                f"{name}_{os.getpid()}", disable_signals=True, disable_rostime=True, disable_rosout=True
            )
    return str(rospy.get_name())


def node_uri() -> str:
    """Return the URI at which this process's node responds to other nodes."""
    return str(rospy.core.get_node_uri())
