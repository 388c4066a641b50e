"""The publishers of one robot in ROS 2; each publisher is created with its first message."""

from __future__ import annotations

from typing import Any, Final

from palaestra_trainer.bags.messages import Content
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.ros.ros2_node import Ros2Node, require

_SENSORS: Final = frozenset(("Image", "LaserScan"))


class RobotPublishers:
    """Publishes messages from plain dicts.

    Readings of sensors are best effort, because an old reading is of no use. Other topics are reliable, so
    that tools with either setting receive them.

    Args:
        node: the node that publishes, which the caller closes.

    Attributes:
        has_transforms: whether tf2_msgs, which has the type of /tf, is installed.
    """

    def __init__(self, node: Ros2Node) -> None:
        self._node = node
        self._publishers: dict[str, Any] = {}
        self.has_transforms = True
        try:
            self._transforms = require("tf2_msgs.msg").TFMessage
        except ConfigurationError:  # every installation of ROS 2 has tf2_msgs, but no wheel on PyPI has it
            self.has_transforms = False

    def publish(self, topic: str, kind: str, content: Content) -> bool:
        """Publish a message, and return whether it is the first of its topic.

        Args:
            topic: the name of the topic; it may be relative to the node's namespace.
            kind: package and name of its type, such as `nav_msgs/Odometry`.
            content: all fields that differ from their defaults.
        """
        package, name = kind.split("/")
        type_ = getattr(require(f"{package}.msg"), name)
        first = topic not in self._publishers
        self._publisher(topic, type_, sensor=name in _SENSORS).publish(filled(type_(), content))
        return first

    def publish_transform(self, content: Content) -> None:
        """Publish a TransformStamped on /tf."""
        stamped = filled(require("geometry_msgs.msg").TransformStamped(), content)
        self._publisher("/tf", self._transforms, sensor=False).publish(self._transforms(transforms=[stamped]))

    def _publisher(self, topic: str, type_: Any, *, sensor: bool) -> Any:
        if topic not in self._publishers:
            qos = require("rclpy.qos")
            policy = qos.ReliabilityPolicy
            profile = qos.QoSProfile(
                depth=1 if sensor else 10, reliability=policy.BEST_EFFORT if sensor else policy.RELIABLE
            )
            self._publishers[topic] = self._node.ros.create_publisher(type_, topic, profile)
        return self._publishers[topic]


def filled(message: Any, content: Content) -> Any:
    """Set the fields of a message, also those of messages inside it, and return it."""
    for name, value in content.items():
        if isinstance(value, dict):
            filled(getattr(message, name), value)
        else:
            setattr(message, name, value)
    return message
