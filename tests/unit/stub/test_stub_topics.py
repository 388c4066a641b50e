"""Messages of sensors: the reading is in the last field of the message type."""

import pytest

from palaestra_protocol.ros.rostypes import last_field, message_type
from palaestra_protocol.ros.tcpros import LENGTH
from palaestra_sim.ros.topics import PublishedTopic, Publisher


class Link:
    """The connection of a subscriber, which keeps the messages."""

    def __init__(self):
        self.sent = []

    def send_newest(self, data):
        """Keep the message."""
        self.sent.append(data)


@pytest.fixture
def publish():
    """`publish(type_name, value, **template)` returns the message as a subscriber decodes it."""

    def send(type_name, value, **template):
        link = Link()
        topic = PublishedTopic("/robotino/gps/values", message_type(type_name), latched=False)
        topic.links.append(link)
        publisher = Publisher(topic, template)
        for _ in range(2):
            publisher.send_value(value, stamp_ns=2_000_000_003)
        return topic.type.codec.decode(link.sent[-1][LENGTH.size :])

    return send


def test_a_reading_of_one_number_fills_the_last_field(publish):
    """Only the sequence number and the time stamp change too; all other fields keep the template's values."""
    message = publish("sensor_msgs/Range", 0.5, header={"frame_id": "robotino/ir1"}, max_range=3.0)

    assert (message.range, message.max_range, message.header.frame_id) == (0.5, 3.0, "robotino/ir1")
    assert (message.header.seq, message.header.stamp.secs, message.header.stamp.nsecs) == (2, 2, 3)


def test_a_reading_of_several_numbers_fills_the_message_inside(publish):
    """An example is the position of a GPS with its three coordinates."""
    message = publish("geometry_msgs/PointStamped", (1.0, 2.0, 3.0), header={"frame_id": "robotino/gps"})

    assert (message.point.x, message.point.y, message.point.z) == (1.0, 2.0, 3.0)


@pytest.mark.parametrize("type_name", ["webots_ros/StringStamped", "std_msgs/Header", "rosgraph_msgs/Clock"])
def test_a_message_that_ends_with_something_else_has_no_reading(publish, type_name):
    """The reading would otherwise overwrite the text at the end of the message."""
    assert last_field(type_name) is None

    with pytest.raises(TypeError, match=f"{type_name} does not end with numbers; use `send`"):
        publish(type_name, 1.0)
