"""The connection to a Robotino over ROS 1, through its driver `robotino_node`.

The connection needs no installed ROS. Four facts about the driver matter:

- The driver is the node that publishes `odom` and subscribes to `cmd_vel`. A connected subscriber other than
  the driver, such as a recorder, confirms no command. The driver obeys every publisher of `cmd_vel`, so no
  other node may publish it.
- It forwards each command once, up to 33 ms late, and has no watchdog. If commands stop, only the timeout of
  the robot's base stops the robot.
- It clips each axis of a command to its limits, and raises a small speed to its minimum, without a notice.
- It publishes the bumper's state only when the state changes, as a latched message. So the bumper counts as
  not pressed until the first message, and the last state stays after a new connection. A message of `odom` or
  `distance_sensors` confirms the state, because all topics are connected again if one of them fails.
"""

from __future__ import annotations

import itertools
import math
import os
import re
import select
import threading
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from typing import Any, Final
from urllib.parse import urlsplit

import structlog

from palaestra_trainer.errors import (
    ConfigurationError,
    LinkError,
    MasterLost,
    RobotUnfit,
    SimulatorFault,
    UnreadableAnswer,
)
from palaestra_trainer.real_robots.camera import ImageSize
from palaestra_trainer.real_robots.readings import ReadingStore
from palaestra_trainer.real_robots.robot_clock import RobotClock
from palaestra_trainer.real_robots.ros1_messages import distances_of, fields_of, odometry_of
from palaestra_trainer.real_robots.ros_images import TOPIC as IMAGES
from palaestra_trainer.real_robots.ros_images import image_of
from palaestra_trainer.real_robots.sensor_layout import UNITS, SensorLayout
from palaestra_trainer.real_robots.topics import ROS1, Topics, refuse_unknown
from palaestra_trainer.robots.geometry import Twist
from palaestra_trainer.ros.master import Master
from palaestra_trainer.ros.publisher import RosPublisher
from palaestra_trainer.ros.subscriber import RosSubscriber
from palaestra_trainer.ros.topic_node import TopicNode

log = structlog.get_logger(__name__)

# The driver's limits, each with its default and its unit; source: RobotinoNode.cpp.
_LIMITS: Final = {"max_linear_vel": (0.2, "m/s"), "max_angular_vel": (1.0, "rad/s")}
_CHECK_S: Final = 2.0
_DRIVER_CONNECTS_S: Final = 5.0
_SILENCE_S: Final = 1.0  # if a reading is older, all topics are connected again
_RETRY_S: Final = 0.5
_END_S: Final = 3.0
_ADDRESS: Final = re.compile(r"ros1://[^/@?#]+(/[A-Za-z][A-Za-z0-9_]*)*/?")
_numbers: Final = itertools.count()  # the nodes of one process need different names

Reader = Callable[[Any, float], None]
Readers = dict[RosSubscriber, Reader]


class Ros1Link:
    """The connection to one Robotino; see `RobotLink`.

    Args:
        address: the address of the ROS master, and the driver's namespace: ros1://HOST:PORT[/NAMESPACE].
        sensors: the order of the distance sensors; the driver's unit is always meters.
        clock: the robot's clock. The time of a reading is the time at which its message arrived.
        topics: topics with other names than those of the driver; see `topics`.

    Raises:
        ConfigurationError: the address does not have this form, or a topic has an unknown name.
    """

    def __init__(
        self,
        address: str,
        sensors: SensorLayout | None = None,
        clock: RobotClock | None = None,
        topics: Topics | None = None,
    ) -> None:
        self.address = address
        self._topics = topics or {}
        refuse_unknown(self._topics, ROS1)
        self._master_uri, self._namespace = _parts(address)
        self._sensors = replace(sensors or SensorLayout(), unit=UNITS[0])
        self._clock = clock or RobotClock()
        self._bumped = False
        self._node: TopicNode | None = None
        self._sees = False
        self._commands: RosPublisher | None = None
        self._driver: str | None = None
        self._over = threading.Event()
        self._open = ExitStack()

    def refuse_unfit(self, speed_m_s: float, turn_rad_s: float) -> None:
        """Refuse a robot without a running driver, or with another client, or whose driver clips the speed.

        The driver does not report the charger, so a charging robot is not refused.

        Raises:
            RobotUnfit: no master responds, no driver runs, another node publishes commands, or the driver's
                limit is below the speed.
        """
        master = Master(self._name("palaestra"), _CHECK_S, self._master_uri)
        commands = self._name("cmd_vel")
        try:
            master.ping()
            self._driver = driver = self._found_driver(master)
            others = [node for node in sorted(master.publishers(commands)) if master.runs(node)]
            limits = {name: master.parameter(f"{driver}/{name}") for name in _LIMITS}
        except (MasterLost, UnreadableAnswer) as error:
            raise RobotUnfit(
                f"{self.address}: {error}; check the address, and that the robot is switched on"
            ) from error
        if others:
            fact = f"{self.address}: {others[0]} publishes {commands}, so it can move the robot"
            raise RobotUnfit(f"{fact}; end this node")
        for (name, (default, unit)), wanted in zip(_LIMITS.items(), (speed_m_s, turn_rad_s), strict=True):
            most = default if limits[name] is None else limits[name]
            if not isinstance(most, int | float) or most < wanted:
                note = " by default" if limits[name] is None else ""
                fact = f"{self.address}: {driver}/{name} is {most!r} {unit}{note}"
                raise RobotUnfit(
                    f"{fact}, below {wanted:g} {unit}; set the parameter and restart the driver, or lower the"
                    " limit"
                )

    def start(self, store: ReadingStore) -> None:
        """Begin to receive readings, after the driver has connected to the topic of commands.

        Raises:
            RobotUnfit: the master or the driver is gone, or the driver does not connect.
        """
        topic = self._name("cmd_vel")
        try:
            driver = self._driver = self._driver or self._found_driver(
                Master(self._name("palaestra"), _CHECK_S, self._master_uri)
            )
            node = self._node = TopicNode(
                self._name(f"palaestra_{os.getpid()}_{next(_numbers)}"), self._master_uri
            )
            self._open.callback(node.close)
            self._commands = RosPublisher(node, topic, "geometry_msgs/Twist")
            self._open.callback(self._commands.close)
        except (MasterLost, UnreadableAnswer) as error:
            raise RobotUnfit(f"{self.address}: {error}; check the network, and try again") from error
        if not self._commands.wait_for_subscriber(_DRIVER_CONNECTS_S, driver):
            fact = f"{self.address}: the driver {driver} has not connected to {topic} at {node.host}"
            raise RobotUnfit(f"{fact}; set ROS_IP to an address of this computer that the robot reaches")
        self._listen_in_thread("robot-topics", self._readers(node, store), lambda: store.newest.oldest_s)

    def use_camera(self, store: ReadingStore, size: ImageSize) -> None:
        """Begin to receive pictures of `image_raw` in a separate thread; each picture replaces the last.

        A node other than the driver may publish the pictures. A failure of that node must not delay the
        driver's readings.
        """
        if self._sees or self._node is None:
            return
        self._sees = True

        def read(message: Any, at_s: float) -> None:
            try:
                store.set_image(image_of(message, size), at_s)
            except LinkError as error:
                store.refuse_image(str(error))

        def newest_s() -> float:
            seen = store.newest
            return -math.inf if seen.image is None else seen.image_s

        topic = self._name(IMAGES)
        store.image_fault = (
            f"no picture arrives on {topic}; start the camera's node, or give its topic with --topic"
        )
        pictures = RosSubscriber(topic, "sensor_msgs/Image", node=self._node)
        self._listen_in_thread("robot-camera", {pictures: read}, newest_s)

    def send(self, twist: Twist) -> None:
        """Send one velocity to all subscribers of `cmd_vel`; the driver itself confirms nothing.

        Raises:
            LinkError: the driver is not connected.
        """
        if self._commands is not None:
            self._commands.publish(**fields_of(twist))
            # `publish` drops a subscriber that takes no message.
            if self._driver in self._commands.subscribers:
                return
        raise LinkError(f"{self._name('cmd_vel')}: the driver is not connected")

    def close(self) -> None:
        """Unregister, end the thread, and close the connections."""
        self._over.set()
        self._open.close()

    def _name(self, name: str) -> str:
        given = self._topics.get(name, name)
        return given if given.startswith("/") else f"{self._namespace}/{given}"

    def _found_driver(self, master: Master) -> str:
        """Return the name of the running node that publishes odometry and subscribes to commands.

        Raises:
            RobotUnfit: there is no such node, or more than one.
            MasterLost: the master does not respond.
            UnreadableAnswer: the master's response is invalid.
        """
        odom, commands = self._name("odom"), self._name("cmd_vel")
        known = sorted(master.publishers(odom) & master.subscribers(commands))
        match [node for node in known if master.runs(node)]:
            case [driver]:
                return driver
            case []:
                fact = f"no node that this computer reaches publishes {odom} and subscribes to {commands}"
                remedy = "start robotino_node, with ROS_IP set to the robot's address"
            case several:
                fact = f"{' and '.join(several)} each publish {odom} and subscribe to {commands}"
                remedy = "end all drivers except one"
        raise RobotUnfit(f"{self.address}: {fact}; {remedy}")

    def _listen_in_thread(self, name: str, readers: Readers, newest_s: Callable[[], float]) -> None:
        """Receive messages until `close`; `newest_s` returns the time of the oldest of these readings."""
        thread = threading.Thread(target=self._listen, args=(readers, newest_s), name=name, daemon=True)
        self._open.callback(thread.join, _END_S)
        thread.start()

    def _listen(self, readers: Readers, newest_s: Callable[[], float]) -> None:
        """Receive messages; after a failure, connect all topics again, so that a latched message returns."""
        while not self._over.is_set():
            try:
                self._receive(readers, newest_s)
            except (SimulatorFault, MasterLost) as error:
                log.debug("no readings", error=str(error))
            self._clock.wait(self._over, self._clock.now_s() + _RETRY_S)
        for topic in readers:
            topic.close()

    def _readers(self, node: TopicNode, store: ReadingStore) -> Readers:
        """Return the topics in the order in which their messages are read."""

        def bumper(message: Any, at_s: float) -> None:
            self._bumped = message.data
            store.set_bumped(at_s, bumped=self._bumped)

        def odometry(message: Any, at_s: float) -> None:
            store.set_odometry(odometry_of(message), at_s)
            store.set_bumped(at_s, bumped=self._bumped)

        def distances(message: Any, at_s: float) -> None:
            store.set_distances(distances_of(message, self._sensors), at_s)
            store.set_bumped(at_s, bumped=self._bumped)

        return {
            RosSubscriber(self._name("bumper"), "std_msgs/Bool", node=node): bumper,
            RosSubscriber(self._name("distance_sensors"), "sensor_msgs/PointCloud", node=node): distances,
            RosSubscriber(self._name("odom"), "nav_msgs/Odometry", node=node): odometry,
        }

    def _receive(self, readers: Readers, newest_s: Callable[[], float]) -> None:
        """Connect all topics and read their messages, until a reading is older than `_SILENCE_S`.

        Raises:
            SimulatorFault: a topic has no publisher, or its connection failed.
            MasterLost: the master does not respond.
        """
        for topic in readers:
            topic.connect()
        at_s = begin_s = self._clock.now_s()
        while not self._over.is_set() and at_s - max(begin_s, newest_s()) < _SILENCE_S:
            select.select(list(readers), [], [], self._clock.real_s(_SILENCE_S))
            at_s = self._clock.now_s()
            # A topic that is not ready may have a message too: a latched one, which came with the header.
            for topic, read in readers.items():
                for message in topic.arrived():  # of all messages, only one may report a press of the bumper
                    try:
                        read(message, at_s)
                    except LinkError as error:
                        log.debug("no reading", error=str(error))


def _parts(address: str) -> tuple[str, str]:
    """Return the URI of the master, and the namespace of the driver: "" or a name that begins with "/".

    Raises:
        ConfigurationError: the address does not have the form ros1://HOST:PORT[/NAMESPACE].
    """
    try:
        parts = urlsplit(address)
        if _ADDRESS.fullmatch(address) and parts.hostname and parts.port:
            return f"http://{parts.netloc}/", parts.path.rstrip("/")
    except ValueError:
        pass
    fact = f"robot: {address!r} is not an address such as ros1://192.168.0.1:11311"
    raise ConfigurationError(f"{fact}; give host and port of the ROS master, and the driver's namespace")
