"""`palaestra-ros2` publishes a robot of a simulator in training as topics of ROS 2, for RViz and bags."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Final

from palaestra_protocol.imports import import_without

# If structlog finds rich, it formats tracebacks with rich, but the log must have plain text.
import_without("rich", "structlog")

from palaestra_protocol.pod.status import ExitCode
from palaestra_trainer.cli.policy_node import separated
from palaestra_trainer.cli.program import leaving, parser, refuse_without_run
from palaestra_trainer.errors import ConfigurationError, MasterLost, TrainerError, UnreadableAnswer
from palaestra_trainer.ros.ros2_node import Ros2Node
from palaestra_trainer.run.signals import Interrupted, Interruption
from palaestra_trainer.run.telemetry.logs import configure_logs
from palaestra_trainer.simulators.ros2_gateway.gateway import Gateway
from palaestra_trainer.simulators.ros2_gateway.publishing import RobotPublishers
from palaestra_trainer.simulators.ros2_gateway.simulators import (
    MasterRobotFinder,
    RobotFinder,
    RunRobotFinder,
)

ABOUT = """\
Publish a robot of a running simulator in ROS 2. rclpy must be installed. The simulator must be the stub or
MuJoCo. This program makes no step, sends no command and enables no sensor: it reads only sensors that the
training reads too.

reads:
  the run directory and the simulator's sidecar; with --master a service of the simulator, ten times a second
  ROS 1 topics of sensors that another node reads, one message of each five times a second
publishes:
  /clock (rosgraph_msgs/msg/Clock), odom (nav_msgs/msg/Odometry), joint_states
  (sensor_msgs/msg/JointState), /tf (tf2_msgs/msg/TFMessage, if it is installed), ten times a second
  irsensor_scan, scans and images of cameras, five times a second
"""
EXIT_CODES = """\
exit codes:
  0  ended by Ctrl-C or SIGTERM
  1  any other error
  2  an argument is wrong, the run is not running or has no such simulator or robot, or rclpy is missing
"""
NAME: Final = "palaestra_ros2"


def gateway(arguments: Sequence[str] | None = None) -> int:
    """Run `palaestra-ros2`; return its exit code."""
    own, ros = separated(list(sys.argv[1:] if arguments is None else arguments))
    options = _parser()
    chosen = options.parse_args(own)
    if (chosen.run is None) == (chosen.master is None):
        options.error("give a run directory, or --master with --robot")
    if chosen.master is not None and chosen.robot is None:
        options.error("--master needs --robot, the name of the robot's node")
    if chosen.master is not None and chosen.simulator is not None:
        options.error("--simulator needs a run directory")
    configure_logs()
    try:
        with Interruption() as interruption:
            _serve(_finder(chosen), ros, interruption)
    except Interrupted:
        return ExitCode.DONE
    except (TrainerError, OSError) as error:
        return refuse_without_run(error)
    return ExitCode.DONE


def _serve(finder: RobotFinder, ros_arguments: Sequence[str], interruption: Interruption) -> None:
    with ExitStack() as stack:
        node = Ros2Node(NAME, arguments=ros_arguments)
        stack.callback(node.close)
        try:
            finder.refuse_missing()
        except (MasterLost, UnreadableAnswer) as error:
            raise ConfigurationError(f"--master: {error}") from error
        node.start()
        say = node.ros.get_logger().info
        publishers = RobotPublishers(node)
        if not publishers.has_transforms:
            say("tf2_msgs is not installed, so /tf is not published")
        Gateway(publishers, interruption.check, say).run(finder)


def _finder(chosen: argparse.Namespace) -> RobotFinder:
    if chosen.master is None:
        return RunRobotFinder(chosen.run, chosen.simulator, chosen.robot)
    os.environ["ROS_MASTER_URI"] = chosen.master  # calls of services use the master of this variable
    return MasterRobotFinder(chosen.master, chosen.robot)


def _parser() -> argparse.ArgumentParser:
    options = parser("palaestra-ros2", ABOUT, EXIT_CODES)
    options.usage = (
        "palaestra-ros2 RUN [--simulator NAME] [--robot NAME] [--ros-args ...]\n"
        "       palaestra-ros2 --master URI --robot NODE [--ros-args ...]"
    )
    add = options.add_argument
    add("run", type=Path, nargs="?", metavar="RUN", help="run directory, such as runs/JOB/0")
    add("--simulator", metavar="NAME", help="simulator of the run, such as collect-0; default: the first")
    add("--master", metavar="URI", help="ROS master of the simulator, instead of a run directory")
    add("--robot", metavar="NAME", help="robot, or name of its node in ROS 1; default: the only robot")
    return options


def gateway_and_leave() -> int:
    """Run `palaestra-ros2`, and end the process soon."""
    return leaving(gateway)


if __name__ == "__main__":
    sys.exit(gateway_and_leave())
