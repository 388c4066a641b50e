"""A transform in a bag has the bytes that ROS 2 reads, made here by hand from its definition.

Sources: TFMessage of geometry2, TransformStamped of common_interfaces, and CDR of the OMG's DDSI-RTPS.
"""

import math
import struct

import pytest
from mcap.reader import make_reader

from palaestra_trainer.bags import messages as bag_messages
from palaestra_trainer.bags.definitions import TRANSFORMS
from palaestra_trainer.bags.writer import BagWriter
from palaestra_trainer.simulators.ros2_gateway import messages

STAMP_S = 86400.032
HALF = math.sqrt(0.5)
POSE = (1.5, -2.0, 0.25, HALF, 0.0, 0.0, HALF)  # x, y, z, then a quarter turn as qw, qx, qy, qz


def by_hand():
    """Return the CDR bytes of a TFMessage with one transform from odom to base_link."""
    body = bytearray(struct.pack("<IiI", 1, 86400, 32_000_000))
    for name in (b"odom\0", b"base_link\0"):
        body += bytes(-len(body) % 4) + struct.pack("<I", len(name)) + name
    body += bytes(-len(body) % 8) + struct.pack("<7d", 1.5, -2.0, 0.25, 0.0, 0.0, HALF, HALF)
    return b"\0\1\0\0" + body


def test_the_transform_of_the_gateway_has_the_bytes_of_ros_2(tmp_path):
    """No package index has a package of tf2_msgs, so no test receives a message on /tf."""
    file = tmp_path / "tf.mcap"
    with BagWriter(file, {}) as bag:
        bag.write("/tf", TRANSFORMS, {"transforms": [messages.transform(STAMP_S, POSE)]}, STAMP_S)

    with file.open("rb") as content:
        [(schema, channel, message)] = make_reader(content).iter_messages()

    assert (schema.name, schema.encoding, channel.message_encoding) == (TRANSFORMS, "ros2msg", "cdr")
    assert message.data == by_hand()


def test_the_transform_moves_a_point_of_the_robot_to_the_frame_of_odometry():
    """A viewer draws the robot's readings by this transform. After a quarter turn, 1 m ahead is along y."""
    [stamped] = bag_messages.transform(STAMP_S, (1.5, -2.0, math.pi / 2.0))["transforms"]
    moved, turn = stamped["transform"]["translation"], stamped["transform"]["rotation"]
    heading = 2.0 * math.atan2(turn["z"], turn["w"])

    assert (stamped["header"]["frame_id"], stamped["child_frame_id"]) == ("odom", "base_link")
    ahead = (moved["x"] + math.cos(heading), moved["y"] + math.sin(heading))
    assert ahead == pytest.approx((1.5, -1.0))
