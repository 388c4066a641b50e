"""The node `robotino_node` of a mock robot: the driver of a Robotino for ROS 1.

All names are relative, as in the driver: with ROS_NAMESPACE=lab, the topic `cmd_vel` is /lab/cmd_vel.

| topic or parameter | type |
|---|---|
| `cmd_vel`, a subscription | geometry_msgs/Twist: linear.x, linear.y and angular.z count |
| `odom` | nav_msgs/Odometry, each period of the driver |
| `distance_sensors` | sensor_msgs/PointCloud in the frame base_link, each period of the driver |
| `bumper` | std_msgs/Bool, latched, only when the state changes |
| `robotino_node/max_linear_vel` and the other `Limits` | parameters |

The transform from odom to base_link, the camera and the other topics of the driver are missing.
"""

from __future__ import annotations

import math
from dataclasses import asdict
from threading import Thread
from typing import Any, Final

from palaestra_sim.mock_robot.driver import PERIOD_S, CommandSlot, Limits, points
from palaestra_sim.mock_robot.odometry import Reading
from palaestra_sim.mock_robot.pace import Clock
from palaestra_sim.mock_robot.robot import MockRobot, MockRobotError
from palaestra_sim.ros import Loop, MasterUnreachable, RosNode

NAME: Final = "robotino_node"


class Ros1Driver:
    """The driver of one robot, registered at a ROS master, from its creation to `close`.

    Args:
        robot: the robot.
        clock: the robot's clock.
        limits: the limits of the commands.
        master_uri: the URI of the ROS master.
        namespace: the namespace of all names; "" means the root.

    Attributes:
        node: the ROS node.

    Raises:
        MockRobotError: no ROS master responds, or the node cannot listen.
    """

    def __init__(
        self, robot: MockRobot, clock: Clock, limits: Limits, master_uri: str, namespace: str = ""
    ) -> None:
        self._robot = robot
        self._clock = clock
        self._slot = CommandSlot(limits)
        self._bumped = False
        self._due_s = clock.now_s()
        self._loop = Loop()
        prefix = f"/{namespace.strip('/')}".rstrip("/")
        self.node = _node(self._loop, f"{prefix}/{NAME}".lstrip("/"), master_uri)
        try:
            self._register(limits, prefix)
        except MasterUnreachable as error:
            self.node.abandon()
            self._loop.close()
            raise MockRobotError(
                f"ROS_MASTER_URI: {master_uri}: {error}; start palaestra-ros-master, or set the variable"
            ) from error
        self._loop.later(0.0, self._period)
        self._thread = Thread(target=self._loop.run, name=NAME, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Unregister the node, and close its connections."""
        self._loop.post(self._end)
        self._thread.join()
        self._loop.close()

    def _register(self, limits: Limits, prefix: str) -> None:
        node = self.node
        for name, value in asdict(limits).items():
            node.set_parameter(name, value)
        self._odometry = node.advertise(
            f"{prefix}/odom",
            "nav_msgs/Odometry",
            template={"header": {"frame_id": "odom"}, "child_frame_id": "base_link"},
        )
        self._distances = node.advertise(
            f"{prefix}/distance_sensors",
            "sensor_msgs/PointCloud",
            template={"header": {"frame_id": "base_link"}},
        )
        self._bumper = node.advertise(f"{prefix}/bumper", "std_msgs/Bool", latched=True)
        node.subscribe(f"{prefix}/cmd_vel", "geometry_msgs/Twist", self._heard)

    def _heard(self, twist: Any) -> None:
        command = (twist.linear.x, twist.linear.y, twist.angular.z)
        if all(map(math.isfinite, command)):  # the simulation cannot compute with infinities and NaN
            self._slot.put(command)

    def _period(self) -> None:
        robot, now_s = self._robot, self._clock.now_s()
        if (command := self._slot.take()) is not None:
            robot.command(command, now_s)
        if robot.bumped() != self._bumped:
            self._bumped = not self._bumped
            self._bumper.send({"data": self._bumped})
        self._odometry.send_stamped(_odometry(robot.odometry()))
        self._distances.send_stamped({"points": points(robot.distances_m())})
        self._due_s = max(self._due_s + PERIOD_S, now_s)
        self._loop.later(max(0.0, self._clock.real_s(self._due_s - now_s)), self._period)

    def _end(self) -> None:
        self.node.close()
        self._loop.stop()


def _node(loop: Loop, name: str, master_uri: str) -> RosNode:
    """Return a node.

    Raises:
        MockRobotError: the node cannot listen on the address of this machine.
    """
    try:
        return RosNode(loop, name, master_uri)
    except OSError as error:
        loop.close()
        fact = f"ROS_HOSTNAME: a ROS node cannot listen: {error.strerror}"
        raise MockRobotError(f"{fact}; set it to localhost, or to a name of this machine") from error


def _odometry(reading: Reading) -> dict[str, Any]:
    """Return the fields of a nav_msgs/Odometry that differ from message to message."""
    x, y, heading, vx, vy, omega, _ = reading
    turn = {"z": math.sin(0.5 * heading), "w": math.cos(0.5 * heading)}
    return {
        "pose": {"pose": {"position": {"x": x, "y": y}, "orientation": turn}},
        "twist": {"twist": {"linear": {"x": vx, "y": vy}, "angular": {"z": omega}}},
    }
