"""A real ROS master for everything in this folder that needs one."""

import os

import pytest

from palaestra_trainer.simulators.master import ensure_master


@pytest.fixture(scope="session")
def master():
    """One master a process, since rospy registers once; it ends with the process."""
    os.environ["ROS_HOSTNAME"] = "localhost"
    os.environ["ROS_MASTER_URI"] = "http://localhost:1"
    ensure_master()
    return os.environ["ROS_MASTER_URI"]
