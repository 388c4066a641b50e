"""Decoding the values in messages of sensors, and rejecting damaged messages."""

import math
import struct

import pytest

from palaestra_protocol.ros.rostypes import message_type
from palaestra_trainer.webots.message_decoding import (
    BOOL,
    FLOAT64,
    POINT,
    RANGE,
    NumberReading,
    PickedReading,
)

KINDS = {
    "sensor_msgs/Range": (RANGE, "range", 0.5),
    "webots_ros/Float64Stamped": (FLOAT64, "data", -1.5),
    "webots_ros/BoolStamped": (BOOL, "data", True),
}


@pytest.fixture(params=KINDS)
def kind(request):
    """Return a type of messages."""
    return request.param


@pytest.fixture
def read(kind):
    """Return a reader for one device, which has read no message yet."""
    return NumberReading("ir1", KINDS[kind][0])


def message(kind, value, frame_id="robotino/ir1"):
    """Return the bytes of a message."""
    fields = {"header": {"seq": 3, "frame_id": frame_id}, KINDS[kind][1]: value}
    return memoryview(message_type(kind).codec.encode(fields))


def test_the_reading_is_the_last_number(kind, read):
    """For each of several messages, the reader returns the value that genpy would return."""
    _, _, value = KINDS[kind]

    assert [read(message(kind, it)) for it in (value, type(value)(0), value)] == [value, 0, value]


def test_a_frame_id_of_another_length_is_read_too(kind, read):
    """The frame_id may be empty, or that of another robot."""
    _, _, value = KINDS[kind]

    assert [read(message(kind, value, name)) for name in ("robotino/ir1", "", "r")] == [value] * 3


@pytest.mark.parametrize("known", [False, True], ids=["first", "later"])
def test_a_message_cut_short_anywhere_is_refused(kind, read, known):
    """A reader that accepted the message would take text of the header for a number."""
    sound = message(kind, KINDS[kind][2])
    if known:
        read(sound)

    for length in range(len(sound)):
        with pytest.raises((ValueError, struct.error)):
            read(sound[:length])


def test_a_message_that_is_too_long_is_refused(kind, read):
    """A message with more bytes than its type needs was sent to the wrong topic."""
    sound = message(kind, KINDS[kind][2])

    with pytest.raises(ValueError, match=f"a message of {len(sound) + 1} bytes instead of {len(sound)}"):
        read(memoryview(bytes([*sound, 0])))


def test_a_message_whose_frame_id_claims_another_length_is_refused(kind, read):
    """The message has the usual length, but its reading is not at the end."""
    _, _, value = KINDS[kind]
    sound = message(kind, value)
    read(sound)
    damaged = bytearray(sound)
    damaged[12] += 1

    with pytest.raises(ValueError, match="a frame_id of 13 bytes instead of 12"):
        read(memoryview(damaged))


@pytest.mark.parametrize("wrong", [float("nan"), float("inf"), float("-inf")])
@pytest.mark.parametrize("kind", ["sensor_msgs/Range", "webots_ros/Float64Stamped"], indirect=True)
def test_what_is_no_finite_number_is_refused_with_the_device(kind, read, wrong):
    """A single NaN in an observation spreads to every weight at the next update."""
    with pytest.raises(ValueError, match=f"{wrong} from ir1"):
        read(message(kind, wrong))


def test_a_reading_of_several_numbers_is_a_tuple():
    """An environment finds x, y and z by their positions in the tuple."""
    point = message_type("geometry_msgs/PointStamped").codec.encode({"point": {"x": 1.0, "y": 2.0, "z": 3.0}})

    assert PickedReading("gps", POINT, (0, 1, 2))(point) == (1.0, 2.0, 3.0)


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_each_number_of_a_tuple_has_to_be_finite(axis):
    """A single NaN in the tuple would reach the loss."""
    point = message_type("geometry_msgs/PointStamped").codec.encode({"point": {axis: math.nan}})

    with pytest.raises(ValueError, match=r"nan.* from gps"):
        PickedReading("gps", POINT, (0, 1, 2))(point)
