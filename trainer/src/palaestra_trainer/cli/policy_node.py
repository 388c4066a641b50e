"""`palaestra-policy-node` is a node of ROS 2 that drives a Robotino to goals with a policy package."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from palaestra_protocol.imports import import_without

# If structlog finds rich, it formats tracebacks with rich, but the log must have plain text.
import_without("rich", "structlog")

from palaestra_protocol.pod.status import ExitCode
from palaestra_trainer.cli.program import leaving, parser, refuse_without_run
from palaestra_trainer.errors import CameraUnfit, ConfigurationError, RobotUnfit, TrainerError
from palaestra_trainer.real_robots.robot_clock import RobotClock
from palaestra_trainer.real_robots.ros2_clock import SimulationClock, SimulationTime
from palaestra_trainer.real_robots.safety import Fence, SafetyRules
from palaestra_trainer.real_robots.topics import ROS2, refuse_unknown, remaps, topics_of
from palaestra_trainer.ros.ros2_node import Ros2Node, require
from palaestra_trainer.run.signals import Interrupted, Interruption
from palaestra_trainer.run.telemetry.logs import configure_logs

if TYPE_CHECKING:
    from palaestra_trainer.real_robots.camera import ImageSize
    from palaestra_trainer.real_robots.deployment.goals import Goals
    from palaestra_trainer.real_robots.robotino import RealRobotino
    from palaestra_trainer.real_robots.ros2 import Ros2Link

ABOUT = """\
Drive a Robotino to goals in ROS 2, with a policy package. rclpy must be installed.

subscribes:
  goal_pose (geometry_msgs/msg/PoseStamped), in the frame of odometry; each goal begins an episode
  odom, irsensor_scan or distance_sensors, bumper, as the robot's driver publishes them
  image_raw (sensor_msgs/msg/Image), if the policy sees images
publishes:
  cmd_vel (geometry_msgs/msg/Twist), 20 times a second while it drives to a goal; otherwise nothing
parameters:
  speed_limit (0.2 m/s), turn_limit (1.0 rad/s), fence (least x and y, then greatest, in m of the frame of
  odometry), use_sim_time (false)

The policy acts at the rate in its package. The node asks no question and needs no held key: another node,
such as a twist mux, or the driver decides whether the robot obeys. This program is not a safety function.
"""
EXIT_CODES = """\
exit codes:
  0  ended by Ctrl-C or SIGTERM; the robot was commanded to stand
  1  any other error
  2  the package, a parameter or an argument is wrong
"""
NAME: Final = "palaestra_policy"
GOAL: Final = "goal_pose"
_CORNERS: Final = 4


def policy_node(arguments: Sequence[str] | None = None) -> int:
    """Run `palaestra-policy-node`; return its exit code."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    own, ros = separated(given)
    options = _parser().parse_args(own)
    configure_logs()
    try:
        with Interruption() as interruption:
            _serve(options, ros, interruption)
    except Interrupted:
        return ExitCode.DONE
    except (TrainerError, OSError) as error:
        return refuse_without_run(error)
    return ExitCode.DONE


def separated(arguments: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the arguments of the program, and those of ROS: from each `--ros-args` to the next `--`."""
    own: list[str] = []
    ros: list[str] = []
    of_ros = False
    for argument in arguments:
        of_ros = of_ros or argument == "--ros-args"
        (ros if of_ros else own).append(argument)
        of_ros = of_ros and argument != "--"
    return own, ros


def _serve(options: argparse.Namespace, ros_arguments: Sequence[str], interruption: Interruption) -> None:
    from palaestra_trainer.real_robots.command_loop import Hooks
    from palaestra_trainer.real_robots.deployment import checked_package
    from palaestra_trainer.real_robots.deployment.deploy import Deployment
    from palaestra_trainer.real_robots.deployment.goals import GoalDriver, Goals, NewGoal, QuietLink
    from palaestra_trainer.real_robots.deployment.record import DeploymentRecord
    from palaestra_trainer.real_robots.robotino import RealRobotino
    from palaestra_trainer.real_robots.ros2 import Ros2Link

    topics = topics_of(options.topic)
    refuse_unknown(topics, (*ROS2, GOAL))
    package = checked_package.read(options.package)
    goals = Goals()

    def check() -> None:
        interruption.check()
        if goals.waits:
            raise NewGoal

    with ExitStack() as stack:
        node = Ros2Node(NAME, arguments=[*remaps(topics), *ros_arguments])
        stack.callback(node.close)
        rules = _rules(node)
        simulation = _simulation(node)
        clock = RobotClock() if simulation is None else SimulationClock(time=simulation)
        link = Ros2Link(f"ros2:{node.ros.get_namespace()}", clock=clock, node=node, check=interruption.check)
        quiet = QuietLink(link)
        about = {"package": str(options.package), "robot": link.address}
        record = DeploymentRecord(options.record or Path(), about)
        if options.record is not None:
            stack.enter_context(record)  # closed after the robot, so the record contains the robot's stop
        hooks = Hooks(check=check, decided=record.decided)
        robot = RealRobotino(quiet, rules, package.period_s, clock, hooks)
        stack.callback(robot.close)
        if simulation is not None:
            stack.callback(simulation.leave)
        say, warn = node.ros.get_logger().info, node.ros.get_logger().warning
        _connect(robot, simulation, interruption, warn)
        _wait_for_images(robot, package.image_size, warn)
        deployment = Deployment(package, robot, record, node.ros.get_logger().debug)
        _subscribe(node, link, goals, rules.fence)
        say(f"ready; waiting for a goal on {node.ros.resolve_topic_name(GOAL)}")
        driver = GoalDriver(robot, quiet, deployment, goals)
        driver.run(interruption.check, say, warn)


def _connect(
    robot: RealRobotino,
    simulation: SimulationTime | None,
    interruption: Interruption,
    warn: Callable[[str], object],
) -> None:
    """Wait until the robot may be driven, because nodes of a launch file start in any order."""
    while True:
        try:
            if simulation is not None:
                simulation.refuse_unset(interruption.check)
            robot.connect()
        except RobotUnfit as error:
            warn(f"{error}; waiting for the robot")
        else:
            return


def _wait_for_images(robot: RealRobotino, size: ImageSize | None, warn: Callable[[str], object]) -> None:
    """If the policy uses images, wait for the camera, because its node may start after this node."""
    if size is None:
        return
    robot.image_size = size
    while True:
        try:
            robot.use_cameras(color=True)
        except CameraUnfit as error:
            warn(f"{error}; waiting for the camera")
        else:
            return


def _simulation(node: Ros2Node) -> SimulationTime | None:
    """Return the time of the simulation; None if the parameter `use_sim_time` is false."""
    if not node.ros.get_parameter("use_sim_time").value:
        return None
    clock = node.ros.get_clock()
    return SimulationTime(lambda: float(clock.now().nanoseconds) * 1e-9)


def _rules(node: Ros2Node) -> SafetyRules:
    speed_m_s = _declared(node, "speed_limit", SafetyRules().speed_m_s)
    turn_rad_s = _declared(node, "turn_limit", SafetyRules().turn_rad_s)
    for name, value in (("speed_limit", speed_m_s), ("turn_limit", turn_rad_s)):
        if not 0.0 < value < math.inf:
            raise ConfigurationError(f"{name}: {value} is not a positive number")
    corners = list(_declared(node, "fence", require("rclpy.parameter").Parameter.Type.DOUBLE_ARRAY) or [])
    if len(corners) not in {0, _CORNERS}:
        raise ConfigurationError(f"fence: {corners} are not four numbers; give least x and y, then greatest")
    fence = Fence((corners[0], corners[1]), (corners[2], corners[3])) if corners else None
    return SafetyRules(speed_m_s=speed_m_s, turn_rad_s=turn_rad_s, fence=fence)


def _declared(node: Ros2Node, name: str, default: Any) -> Any:
    """Declare a read-only parameter and return its value; for no default value, `default` is the type.

    Raises:
        ConfigurationError: the value has another type.
    """
    descriptor = require("rcl_interfaces.msg").ParameterDescriptor(read_only=True)
    try:
        return node.ros.declare_parameter(name, default, descriptor).value
    except require("rclpy.exceptions").InvalidParameterTypeException as error:
        raise ConfigurationError(f"{name}: {error}; write a number such as 1.0") from error


def _subscribe(node: Ros2Node, link: Ros2Link, goals: Goals, fence: Fence | None) -> None:
    """Add to `goals` each goal whose frame is that of odometry, and whose position is within the fence."""
    warn = node.ros.get_logger().warning

    def take(message: Any) -> None:
        frame, x_m, y_m = message.header.frame_id, message.pose.position.x, message.pose.position.y
        if frame not in {"", link.frame_id}:
            warn(
                f"goal ignored: its frame is {frame}, but the frame of odometry is {link.frame_id}; set the "
                f"fixed frame of RViz to {link.frame_id}, or transform the goal"
            )
        elif not (math.isfinite(x_m) and math.isfinite(y_m)):
            warn("goal ignored: its position is not finite")
        elif fence is not None and not fence.admits((x_m, y_m)):
            warn(f"goal ignored: ({x_m:g}, {y_m:g}) is too close to the fence for the robot")
        else:
            goals.put((x_m, y_m))

    qos = require("rclpy.qos")
    reliable = qos.QoSProfile(depth=1, reliability=qos.ReliabilityPolicy.RELIABLE)
    node.ros.create_subscription(require("geometry_msgs.msg").PoseStamped, GOAL, take, reliable)


def _parser() -> argparse.ArgumentParser:
    options = parser("palaestra-policy-node", ABOUT, EXIT_CODES)
    options.usage = "palaestra-policy-node PACKAGE [--record FILE] [--topic NAME=TOPIC] [--ros-args ...]"
    options.add_argument("package", type=Path, metavar="PACKAGE", help="folder or zip of the package")
    options.add_argument(
        "--record", type=Path, metavar="FILE", help="also write a bag, as palaestra-deploy does"
    )
    options.add_argument(
        "--topic",
        action="append",
        default=[],
        metavar="NAME=TOPIC",
        help="use TOPIC instead of the topic NAME above, such as odom=/robot/odom; repeatable",
    )
    return options


def policy_node_and_leave() -> int:
    """Run `palaestra-policy-node`; before the process ends, the robot has been commanded to stand."""
    return leaving(policy_node)


if __name__ == "__main__":
    sys.exit(policy_node_and_leave())
