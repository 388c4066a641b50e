"""The definitions of message types in a bag are complete."""

import re

import pytest

from palaestra_protocol.ros.syntax import BUILT_IN, parse
from palaestra_trainer.bags.definitions import ODOMETRY, TRANSFORMS, TYPES, definition


@pytest.mark.parametrize("type_name", TYPES)
def test_a_definition_contains_each_type_that_it_names_once(type_name):
    """A reader has only the definitions in the bag, so a missing one would make messages unreadable."""
    own, *others = re.split(r"^=+\nMSG: ", definition(type_name), flags=re.MULTILINE)
    texts = {type_name.replace("/msg/", "/"): own} | dict(text.split("\n", 1) for text in others)

    fields = [field for name, text in texts.items() for field in parse(name, text).fields]

    assert len(texts) == 1 + len(others)
    assert {field.type for field in fields} - BUILT_IN == {text.partition("\n")[0] for text in others}
    assert all(field.type not in {"time", "duration"} for field in fields), "types of ROS 1"


def test_the_header_is_that_of_ros_2():
    """The header of ROS 1 begins with a sequence number, which would shift every field after it."""
    text = definition(ODOMETRY)

    assert "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n" in text
    assert "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n" in text
    assert definition(TRANSFORMS).startswith("geometry_msgs/TransformStamped[] transforms\n")


def test_a_type_that_no_message_has_is_refused():
    """The definition of such a type may differ between ROS 1 and ROS 2, like that of CameraInfo."""
    with pytest.raises(KeyError):
        definition("sensor_msgs/msg/CameraInfo")
