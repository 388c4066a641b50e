"""Choose the connection to a robot by the scheme of its address."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.real_robots.link import RobotLink
from palaestra_trainer.real_robots.rest import RestLink
from palaestra_trainer.real_robots.robot_clock import RobotClock
from palaestra_trainer.real_robots.ros1 import Ros1Link
from palaestra_trainer.real_robots.ros2 import Ros2Link
from palaestra_trainer.real_robots.sensor_layout import SensorLayout
from palaestra_trainer.real_robots.topics import Topics


def _over_rest(address: str, sensors: SensorLayout, clock: RobotClock, topics: Topics) -> RobotLink:
    if topics:
        raise ConfigurationError(
            "--topic: the REST interface has no topics; omit it, or use an address of ROS"
        )
    return RestLink(address, sensors, clock)


LINKS: Final[Mapping[str, Callable[[str, SensorLayout, RobotClock, Topics], RobotLink]]] = {
    "http://": _over_rest,
    "ros1://": Ros1Link,
    "ros2:": Ros2Link,
}


def link_to(
    address: str, sensors: SensorLayout, clock: RobotClock, topics: Topics | None = None
) -> RobotLink:
    """Return the connection to the robot at an address, such as http://192.168.0.1; it is not open yet.

    Args:
        address: the address of the robot; it begins with a key of `LINKS`.
        sensors: how the robot reports its distance sensors.
        clock: the robot's clock.
        topics: topics with other names than those of the driver.

    Raises:
        ConfigurationError: the scheme is not known, the address does not have the form of its scheme, the
            connection does not have one of the topics, or it needs rclpy, which is not installed.
    """
    for scheme, link in LINKS.items():
        if address.startswith(scheme):
            return link(address, sensors, clock, topics or {})
    known = " or ".join(LINKS)
    raise ConfigurationError(f"robot: {address!r} has an unknown scheme; begin it with {known}")
