"""A ROS master for programs that run outside a pod."""

from __future__ import annotations

import os
import socket
import subprocess
import sys

from palaestra_trainer.errors import MasterLost
from palaestra_trainer.ros import Master
from palaestra_trainer.simulators.child import first_line, start_child


def ensure_master() -> None:
    """Make sure that a ROS master answers, by starting one on a free port if none does.

    Sets ROS_MASTER_URI and ROS_HOSTNAME of this process to the one it starts.
    """
    try:
        Master("/palaestra").ping()
    except MasterLost:
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = free.getsockname()[1]
        os.environ["ROS_MASTER_URI"] = f"http://localhost:{port}"
        os.environ["ROS_HOSTNAME"] = "localhost"
        module = [sys.executable, "-m", "palaestra_trainer.simulators.own_master", str(port)]
        if not first_line(start_child(module, stderr=subprocess.DEVNULL)):
            raise MasterLost(
                f"a ROS master could not be started on port {port}; start rosmaster by hand"
            ) from None
