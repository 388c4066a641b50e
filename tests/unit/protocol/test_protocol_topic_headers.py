"""The headers of topics: the peers that a publisher or a subscriber accepts."""

import pytest

from palaestra_protocol.ros.rostypes import message_type
from palaestra_protocol.ros.topic_headers import (
    HeaderRefused,
    check_publisher,
    publisher_header,
    subscriber_header,
)

TWIST, BOOL = message_type("geometry_msgs/Twist"), message_type("std_msgs/Bool")


def test_a_publisher_and_a_subscriber_of_one_type_accept_each_other():
    """Both headers have the type, its md5 sum and its definition. Tools read the definition."""
    wanted = subscriber_header("/listener", "/cmd_vel", TWIST)
    given = publisher_header("/speaker", "/cmd_vel", TWIST, wanted, latched=True)
    check_publisher(given, TWIST)

    assert (wanted["callerid"], given["callerid"]) == ("/listener", "/speaker")
    assert wanted["tcp_nodelay"] == given["latching"] == "1"
    assert wanted["md5sum"] == given["md5sum"] == "9f195f881246fdfa2798d1d3eebca84a"
    assert given["message_definition"].startswith("geometry_msgs/Vector3 linear\n")


def test_a_publisher_accepts_a_tool_that_reads_every_type():
    """`rostopic echo` learns the type from the publisher's header."""
    assert publisher_header("/speaker", "/cmd_vel", TWIST, {"md5sum": "*"})["md5sum"] == TWIST.md5


def test_a_publisher_refuses_another_type():
    """The subscriber would decode the bytes of this publisher as wrong numbers."""
    with pytest.raises(HeaderRefused, match=rf"wants md5sum {BOOL.md5}, but geometry_msgs/Twist has 9f195f"):
        publisher_header("/speaker", "/cmd_vel", TWIST, subscriber_header("/listener", "/cmd_vel", BOOL))


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ({"error": "no such topic"}, "refused the connection: no such topic"),
        ({"md5sum": BOOL.md5}, f"sends md5sum {BOOL.md5}, not that of geometry_msgs/Twist"),
        ({}, "sends md5sum None"),
    ],
)
def test_a_subscriber_refuses_a_publisher_that_does_not_fit(header, message):
    """A command that is read from other bytes could move a robot."""
    with pytest.raises(HeaderRefused, match=message):
        check_publisher(header, TWIST)
