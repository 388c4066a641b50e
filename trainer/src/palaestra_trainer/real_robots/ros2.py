"""The connection to a Robotino over the topics of its ROS 2 driver, such as rto_node of ros2-robotino.

| topic | type | here |
|---|---|---|
| odom | nav_msgs/msg/Odometry | read |
| irsensor_scan | sensor_msgs/msg/LaserScan, a ray for each of the nine sensors | read |
| distance_sensors | sensor_msgs/msg/PointCloud, as a bridge to the ROS 1 driver publishes it | read |
| bumper | std_msgs/msg/Bool | read |
| image_raw | sensor_msgs/msg/Image | read if the policy sees images |
| cmd_vel | geometry_msgs/msg/Twist | published |

Odometry, distances and images have best-effort subscriptions. Such a subscription matches reliable publishers
too, and a lost message does no harm, because an old reading is of no use.

rto_node publishes the bumper only when it changes, and keeps no message for later subscribers. So the bumper
counts as not pressed before the first message. While a node publishes the topic, each odometry confirms the
bumper's last state. Another driver may latch the state. A latched message arrives only in a subscription
that is transient local, and both sides warn if such a subscription meets a volatile publisher. So the bumper
has a subscription for each combination of reliability and durability that its publishers offer. If the driver
never reports the bumper, a bump cannot be detected.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

import numpy as np
import structlog
from numpy.typing import NDArray

from palaestra_trainer.errors import ConfigurationError, LinkError, RobotUnfit
from palaestra_trainer.real_robots.camera import ImageSize
from palaestra_trainer.real_robots.readings import Odometry, ReadingStore
from palaestra_trainer.real_robots.robot_clock import RobotClock
from palaestra_trainer.real_robots.ros1_messages import distances_of as distances_of_points
from palaestra_trainer.real_robots.ros1_messages import odometry_of
from palaestra_trainer.real_robots.ros2_messages import distances_of as distances_of_scan
from palaestra_trainer.real_robots.ros_images import TOPIC as IMAGES
from palaestra_trainer.real_robots.ros_images import image_of
from palaestra_trainer.real_robots.sensor_layout import UNITS, SensorLayout
from palaestra_trainer.real_robots.topics import ROS2, Topics, refuse_unknown, remaps
from palaestra_trainer.robots.geometry import Twist
from palaestra_trainer.ros.ros2_node import Ros2Node, require
from palaestra_trainer.waiting.check import Check, go_on

log = structlog.get_logger(__name__)

SCHEME: Final = "ros2"
_ADDRESS: Final = re.compile(r"ros2:((?:/[A-Za-z_][A-Za-z0-9_]*)*)/?")
_BUMPS: Final = 10  # messages of the bumper that may wait to be read
_FIRST_S: Final = 5.0
_LOOK_S: Final = 0.02

Floats = NDArray[np.float32]


class Ros2Link:
    """The connection to one Robotino; see `RobotLink`.

    Args:
        address: `ros2:`, or `ros2:/NAMESPACE` for topics such as /NAMESPACE/odom.
        sensors: the order of the distance sensors; the driver's unit is always meters.
        clock: the robot's clock. The time of a reading is the time at which its message arrived.
        topics: topics of a new node with other names than those of the driver; see `topics`.
        node: the node that subscribes and publishes, which the caller closes; None: a new node.
        check: called often while the connection waits for the robot; it may raise.

    Attributes:
        frame_id: the frame of the newest odometry, such as `odom`; empty before the first odometry.
        odometry: the newest odometry; None before the first odometry.

    Raises:
        ConfigurationError: the address or a name of a topic is wrong, or rclpy is not installed.
    """

    def __init__(
        self,
        address: str,
        sensors: SensorLayout | None = None,
        clock: RobotClock | None = None,
        topics: Topics | None = None,
        node: Ros2Node | None = None,
        check: Check = go_on,
    ) -> None:
        namespace = _namespace(address)
        self.address = address
        self.frame_id = ""
        self.odometry: Odometry | None = None
        self._sensors = replace(sensors or SensorLayout(), unit=UNITS[0])
        self._clock = clock or RobotClock()
        self._check = check
        refuse_unknown(topics or {}, ROS2)
        self._node = node or Ros2Node("palaestra", namespace or None, remaps(topics or {}))
        self._owned = node is None
        self._store = ReadingStore()
        self._bumped = False
        self._heard_bumpers: list[tuple[Any, Any]] = []
        self._open = True
        self._sees = False
        self._twist = require("geometry_msgs.msg").Twist
        self._commands = self._subscribe()
        self._node.start()

    def refuse_unfit(self, speed_m_s: float, turn_rad_s: float) -> None:
        """Refuse a robot without odometry, or without a subscriber of the commands.

        Topics show neither a charger nor the driver's limit of speed.

        Raises:
            RobotUnfit: within 5 s, no odometry arrived, or no node subscribed to the commands.
        """
        del speed_m_s, turn_rad_s
        end_s = time.monotonic() + _FIRST_S
        while self.odometry is None or not self._commands.get_subscription_count():
            if time.monotonic() > end_s:
                raise RobotUnfit(f"{self.address}: {self._missing()}")
            self._check()
            time.sleep(_LOOK_S)

    def start(self, store: ReadingStore) -> None:
        """Put readings into `store` from now on."""
        self._store = store

    def use_camera(self, store: ReadingStore, size: ImageSize) -> None:
        """Begin to receive pictures of `image_raw`; each picture replaces the previous picture."""
        if self._sees:
            return
        self._sees = True

        def read(message: Any) -> None:
            at_s = self._clock.now_s()
            try:
                store.set_image(image_of(message, size), at_s)
            except LinkError as error:
                store.refuse_image(str(error))

        topic = self._resolved(IMAGES)
        store.image_fault = (
            f"no picture arrives on {topic}; start the camera's node, or give its topic with --topic"
        )
        self._node.ros.create_subscription(require("sensor_msgs.msg").Image, IMAGES, read, _newest())

    def send(self, twist: Twist) -> None:
        """Publish one velocity; ROS 2 does not confirm that the robot has taken it."""
        if not self._open or not self._commands.get_subscription_count():
            raise LinkError(f"no node subscribes to {self._commands.topic_name}")
        message = self._twist()
        message.linear.x, message.linear.y, message.angular.z = map(float, twist)
        self._commands.publish(message)

    def close(self) -> None:
        """Publish nothing from now on, and end the node unless it was given."""
        self._open = False
        if self._owned:
            self._node.close()

    def _subscribe(self) -> Any:
        """Subscribe to odometry and distances, and return the publisher of the commands."""
        qos = require("rclpy.qos")
        sensor_messages = require("sensor_msgs.msg")
        for kind, topic, read in (
            (require("nav_msgs.msg").Odometry, "odom", self._read_odometry),
            (sensor_messages.LaserScan, "irsensor_scan", self._distances(distances_of_scan)),
            (sensor_messages.PointCloud, "distance_sensors", self._distances(distances_of_points)),
        ):
            self._node.ros.create_subscription(kind, topic, read, _newest())
        return self._node.ros.create_publisher(
            self._twist, "cmd_vel", qos.QoSProfile(depth=1, reliability=qos.ReliabilityPolicy.RELIABLE)
        )

    def _read_odometry(self, message: Any) -> None:
        at_s = self._clock.now_s()
        try:
            odometry = odometry_of(message)
        except LinkError as error:
            log.debug("no reading", error=str(error))
            return
        self.frame_id, self.odometry = message.header.frame_id, odometry
        self._store.set_odometry(odometry, at_s)
        self._confirm_bumper(at_s)

    def _confirm_bumper(self, at_s: float) -> None:
        """Store the bumper's last state again, while a node publishes it.

        A bumper may be published only when it changes, so no message may be lost. Each kind of publisher gets
        a subscription with its own reliability and durability, because no subscription fits them all.
        """
        publishers = self._node.ros.get_publishers_info_by_topic(self._resolved("bumper"))
        if publishers:
            self._store.set_bumped(at_s, bumped=self._bumped)
        qos = require("rclpy.qos")
        for each in publishers:
            offered = each.qos_profile.reliability, each.qos_profile.durability
            if offered not in self._heard_bumpers:
                self._heard_bumpers.append(offered)
                profile = qos.QoSProfile(depth=_BUMPS, reliability=offered[0], durability=offered[1])
                self._node.ros.create_subscription(
                    require("std_msgs.msg").Bool, "bumper", self._read_bumper, profile
                )

    def _read_bumper(self, message: Any) -> None:
        self._bumped = bool(message.data)
        self._store.set_bumped(self._clock.now_s(), bumped=self._bumped)

    def _distances(self, meters_of: Callable[[Any, SensorLayout], Floats]) -> Callable[[Any], None]:
        def read(message: Any) -> None:
            try:
                distances_m = meters_of(message, self._sensors)
            except LinkError as error:
                log.debug("no reading", error=str(error))
                return
            self._store.set_distances(distances_m, self._clock.now_s())

        return read

    def _missing(self) -> str:
        if self.odometry is None:
            topic = self._resolved("odom")
            return (
                f"no odometry arrives on {topic}; start the robot's driver, and compare the namespace and "
                "ROS_DOMAIN_ID"
            )
        fact = f"no node subscribes to {self._commands.topic_name}"
        return f"{fact}; start the robot's driver, or give its topic with --topic"

    def _resolved(self, topic: str) -> str:
        return str(self._node.ros.resolve_topic_name(topic))


def _newest() -> Any:
    """Return the quality of service for readings: best effort, and only the newest message."""
    qos = require("rclpy.qos")
    return qos.QoSProfile(depth=1, reliability=qos.ReliabilityPolicy.BEST_EFFORT)


def _namespace(address: str) -> str:
    if (found := _ADDRESS.fullmatch(address)) is None:
        raise ConfigurationError(f"robot: {address!r} is not an address such as ros2: or ros2:/robot1")
    return found[1]
