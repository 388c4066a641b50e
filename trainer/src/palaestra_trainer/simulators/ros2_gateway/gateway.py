"""The loop that reads a robot ten times a second, and publishes it."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any, Final

from palaestra_protocol.scene import SceneState, VisibleScene
from palaestra_trainer.bags.messages import Content
from palaestra_trainer.errors import ConfigurationError, MasterLost, SimulatorFault, UnreadableAnswer
from palaestra_trainer.robots.robotino import Robotino
from palaestra_trainer.ros.master import Master
from palaestra_trainer.simulators.ros2_gateway import messages
from palaestra_trainer.simulators.ros2_gateway.glances import IMAGE, SCAN, WatchedTopics
from palaestra_trainer.simulators.ros2_gateway.publishing import RobotPublishers
from palaestra_trainer.simulators.ros2_gateway.simulators import (
    RobotFinder,
    ShownRobot,
    caller_id,
    shown_node,
)
from palaestra_trainer.waiting.check import Check

POSE_S: Final = 0.1
SENSOR_S: Final = 0.2
_AGAIN_S: Final = 0.2
_INFRARED: Final = tuple(f"{name}/value" for name in Robotino.infrared)
_CONVERTED: Final[Mapping[str, Callable[[float, Any], Content]]] = {
    IMAGE: messages.image,
    SCAN: messages.laser_scan,
}

Say = Callable[[str], object]


class Gateway:
    """Publishes one robot until `check` raises.

    Args:
        publishers: the publishers of ROS 2.
        check: called ten times a second; it raises to end the loop.
        say: takes the lines for people.
    """

    def __init__(self, publishers: RobotPublishers, check: Check, say: Say) -> None:
        self._publishers = publishers
        self._check = check
        self._say = say
        self._waits = False

    def run(self, finder: RobotFinder) -> None:
        """Publish the robot that `finder` finds, and find it again after each restart of its simulator.

        Raises:
            ConfigurationError: the simulator does not describe its world, or does not have the robot.
        """
        while True:
            self._check()
            try:
                self._follow(finder.find())
            except (SimulatorFault, MasterLost, UnreadableAnswer) as error:
                if not self._waits:
                    self._say(f"waits for the simulator: {error}")
                self._waits = True
                time.sleep(_AGAIN_S)

    def _follow(self, robot: ShownRobot) -> None:
        scene = _scene(robot)
        node = shown_node(scene, robot.name)
        sensors = self._sensors(robot)
        last: tuple[float, int] | None = None
        due_s = 0.0
        self._announce(robot, known_master=sensors is not None)
        while True:
            began_s = time.monotonic()
            self._check()
            state = robot.reader.scene_state()
            if state.revision != scene.revision:
                scene = _scene(robot)
                node = shown_node(scene, robot.name)
            self._publishers.publish("/clock", "rosgraph_msgs/Clock", messages.clock(state.time_s))
            # A state is published only once, because tf logs a warning for each transform whose time it
            # already has.
            if (state.time_s, state.revision) != last:
                last = (state.time_s, state.revision)
                self._publish(scene, state, node)
                if sensors is not None and began_s >= due_s:
                    due_s = began_s + SENSOR_S
                    self._publish_sensors(sensors, state.time_s)
            time.sleep(max(0.0, began_s + POSE_S - time.monotonic()))

    def _announce(self, robot: ShownRobot, *, known_master: bool) -> None:
        self._waits = False
        topics = "/clock, odom, joint_states" + (", /tf" if self._publishers.has_transforms else "")
        sensors = "and the sensors that the training reads" if known_master else "without sensors"
        self._say(f"publishes {topics} {sensors}, of robot {robot.name}, from {robot.place}")

    def _publish(self, scene: VisibleScene, state: SceneState, node: str) -> None:
        pose = messages.robot_pose(scene, state, node)
        self._publishers.publish("odom", "nav_msgs/Odometry", messages.odometry(state.time_s, pose))
        if self._publishers.has_transforms:
            self._publishers.publish_transform(messages.transform(state.time_s, pose))
        if joints := messages.joints_of(scene, state, node):
            content = messages.joint_state(state.time_s, joints)
            self._publishers.publish("joint_states", "sensor_msgs/JointState", content)

    def _sensors(self, robot: ShownRobot) -> WatchedTopics | None:
        if robot.master_uri is None:
            return None
        return WatchedTopics(Master(caller_id(), uri=robot.master_uri), caller_id(), robot.ros_name)

    def _publish_sensors(self, sensors: WatchedTopics, time_s: float) -> None:
        """Publish one message of each sensor that sends one in time."""
        try:
            types = sensors.types()
        except (MasterLost, UnreadableAnswer):
            return  # a run in a container has a master that is not reachable from here
        if types.keys() >= set(_INFRARED):
            with suppress(SimulatorFault):  # if the simulator has ended, the next request of its state fails
                volts = [message.range for message in sensors.next(_INFRARED)]
                self._publish_sensor("irsensor_scan", SCAN, messages.infrared_scan(time_s, volts))
        for topic, kind in types.items():
            if kind in _CONVERTED:
                with suppress(SimulatorFault):
                    (message,) = sensors.next([topic])
                    self._publish_sensor(topic, kind, _CONVERTED[kind](time_s, message))

    def _publish_sensor(self, topic: str, kind: str, content: Content) -> None:
        if self._publishers.publish(topic, kind, content):
            self._say(f"also publishes {topic} ({kind})")


def _scene(robot: ShownRobot) -> VisibleScene:
    scene = robot.reader.scene()
    if scene is None:
        raise ConfigurationError(
            f"{robot.place}: does not describe its world; use the driver stub or mujoco, which do"
        )
    return scene
