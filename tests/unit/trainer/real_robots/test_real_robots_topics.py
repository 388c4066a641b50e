"""Topics that a person names in place of those of a robot's driver."""

import re

import pytest

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.real_robots.connect import link_to
from palaestra_trainer.real_robots.robot_clock import RobotClock
from palaestra_trainer.real_robots.sensor_layout import SensorLayout
from palaestra_trainer.real_robots.topics import remaps, topics_of


def test_topics_are_named_as_the_driver_names_them():
    """A topic may be a full name, or one in the namespace of the driver."""
    assert topics_of(["odom=/robot/odom", "image_raw=front/image"]) == {
        "odom": "/robot/odom",
        "image_raw": "front/image",
    }
    assert topics_of([]) == {}


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (["odom"], "--topic: 'odom' is not NAME=TOPIC, such as odom=/robot/odom"),
        (["odom="], "--topic: 'odom=' is not NAME=TOPIC"),
        (["=/odom"], "--topic: '=/odom' is not NAME=TOPIC"),
        (["odom=/a b"], "--topic: 'odom=/a b' is not NAME=TOPIC"),
        (["odom=/a/"], "--topic: 'odom=/a/' is not NAME=TOPIC"),
        (["odom:=/a"], "--topic: 'odom:=/a' is not NAME=TOPIC"),
        (["odom=/a", "odom=/b"], "--topic: odom is given twice; give one topic"),
    ],
)
def test_a_text_of_another_form_is_refused(given, message):
    """A topic that is ignored would leave the robot without a reading."""
    with pytest.raises(ConfigurationError, match=re.escape(message)):
        topics_of(given)


@pytest.mark.parametrize(
    ("address", "name", "message"),
    [
        (
            "http://192.168.0.1",
            "odom",
            "--topic: the REST interface has no topics; omit it, or use an address",
        ),
        (
            "ros1://robot:11311",
            "irsensor_scan",
            "use one of bumper, cmd_vel, distance_sensors, image_raw, odom",
        ),
        (
            "ros2:",
            "scan",
            "'scan' is neither read nor published; use one of bumper, cmd_vel, distance_sensors",
        ),
    ],
)
def test_a_name_that_the_connection_does_not_have_is_refused(address, name, message):
    """The message lists the names, because drivers of other robots have other ones."""
    with pytest.raises(ConfigurationError, match=re.escape(message)):
        link_to(address, SensorLayout(), RobotClock(), {name: "/other"})


def test_a_node_of_ros_2_gets_topics_as_remaps():
    """The list ends with `--`, so that ROS does not parse arguments that a person adds."""
    assert remaps({"odom": "/o", "bumper": "b"}) == ["--ros-args", "-r", "odom:=/o", "-r", "bumper:=b", "--"]
    assert remaps({}) == []
