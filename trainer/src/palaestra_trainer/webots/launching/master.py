"""Start a ROS master for programs that run outside a pod."""

from __future__ import annotations

import os
import subprocess
import sys

from palaestra_trainer.errors import MasterLost
from palaestra_trainer.ros import Master
from palaestra_trainer.webots.launching.subprocesses import first_line, start_child


def ensure_master(address: str = "127.0.0.1") -> None:
    """Start a ROS master on a free port, unless a master responds at ROS_MASTER_URI.

    Set ROS_MASTER_URI and ROS_HOSTNAME of this process for the new master.

    Args:
        address: the address of this machine on which a new master listens. The default is a number, because
            a bare chroot cannot resolve localhost.
    """
    try:
        Master("/palaestra").ping()
    except MasterLost:
        os.environ["ROS_HOSTNAME"] = address  # the new master reads it too
        module = [sys.executable, "-P", "-m", "palaestra_trainer.ros_master"]
        program = [*module, f"--listen={address}:0", "--until-stdin-closes"]
        uri = first_line(start_child(program, stderr=subprocess.DEVNULL)).strip()
        if not uri.startswith("http://"):
            raise MasterLost("a ROS master could not be started; start palaestra-ros-master") from None
        os.environ["ROS_MASTER_URI"] = uri
