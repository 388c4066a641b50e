"""Corrupted messages and service responses, as bytes."""

import math

import pytest

from palaestra_protocol.ros.rostypes import message_type, reading_field, service_type
from palaestra_protocol.ros.tcpros import LENGTH, FrameReader, frame
from palaestra_sim.faults.corruption import damaged_answer, damaged_message
from palaestra_sim.faults.parser import parse

WRONG_VALUE = parse("wrong_value", "test")
WRONG_SHAPE = parse("wrong_shape", "test")


def message(type_name, **fields):
    """Return the frame of a message."""
    return frame(message_type(type_name).codec.encode(fields))


def payload(data):
    """Return the content of a frame, which must be complete."""
    (found,) = FrameReader().feed(data)
    return found


@pytest.mark.parametrize(
    ("type_name", "field"), [("sensor_msgs/Range", "range"), ("webots_ros/Float64Stamped", "data")]
)
def test_the_reading_becomes_nan_and_the_rest_stays(type_name, field):
    """The header stays correct, so only a client that checks the reading notices the fault."""
    sound = message(type_name, header={"seq": 7, "frame_id": "robotino/ir1"}, **{field: 1.5})

    read = message_type(type_name).codec.decode(payload(damaged_message(type_name, sound, WRONG_VALUE)))

    assert math.isnan(getattr(read, field))
    assert (read.header.seq, read.header.frame_id) == (7, "robotino/ir1")


def test_all_numbers_of_a_reading_become_nan():
    """If only one coordinate of a GPS became NaN, a client that checks another one would not notice."""
    sound = message("geometry_msgs/PointStamped", point={"x": 1.0, "y": 2.0, "z": 3.0})

    wrong = payload(damaged_message("geometry_msgs/PointStamped", sound, WRONG_VALUE))
    read = message_type("geometry_msgs/PointStamped").codec.decode(wrong)

    assert all(map(math.isnan, (read.point.x, read.point.y, read.point.z)))


def test_a_reading_in_the_middle_of_a_message_becomes_nan_alone():
    """Gyro and accelerometer share this message type, so only the gyro's own field becomes NaN.

    In a covariance, -1 means that the sensor has no such reading, so this value must stay.
    """
    fields = {
        "angular_velocity": {"x": 1.0, "y": 2.0, "z": 3.0},
        "orientation_covariance": [-1.0, *[0.0] * 8],
    }
    sound = message("sensor_msgs/Imu", header={"frame_id": "robotino/gyro"}, **fields)

    wrong = payload(damaged_message("sensor_msgs/Imu", sound, WRONG_VALUE, "angular_velocity"))
    read = message_type("sensor_msgs/Imu").codec.decode(wrong)

    assert all(map(math.isnan, read.angular_velocity))
    assert read.orientation_covariance[0] == -1.0
    assert (*read.linear_acceleration, *read.linear_acceleration_covariance) == (0.0,) * 12


@pytest.mark.parametrize(
    ("type_name", "field"),
    [("sensor_msgs/Image", "height"), ("sensor_msgs/Image", "data"), ("std_msgs/Header", "stamp")],
)
def test_a_field_without_a_fixed_place_or_without_numbers_has_no_reading(type_name, field):
    """Writing NaN at a guessed position would overwrite the bytes of another field."""
    assert reading_field(type_name, field) is None


def test_a_reading_that_the_message_does_not_have_is_an_error():
    """A wrong row in the table of devices must fail in its own tests, not in a client."""
    with pytest.raises(KeyError, match=r"sensor_msgs/Range\.distance"):
        reading_field("sensor_msgs/Range", "distance")


def test_a_message_too_short_for_a_reading_stays_short():
    """A GPS message that was cut three times is shorter than its reading."""
    sound = message("geometry_msgs/PointStamped")
    damages = (*WRONG_SHAPE * 3, *WRONG_VALUE)

    assert len(payload(damaged_message("geometry_msgs/PointStamped", sound, damages))) < 24


def test_a_bumper_has_nothing_to_become_nan():
    """The reading of a bumper is True or False, so it cannot become NaN."""
    sound = message("webots_ros/BoolStamped", data=True)

    assert damaged_message("webots_ros/BoolStamped", sound, WRONG_VALUE) == sound


def test_a_message_cut_short_is_a_whole_frame_that_cannot_be_read():
    """The frame has a correct length, so the reader finds the start of the next message."""
    sound = message("sensor_msgs/Range", range=1.5)

    short = payload(damaged_message("sensor_msgs/Range", sound, WRONG_SHAPE))

    assert len(short) == (len(sound) - LENGTH.size) // 2
    with pytest.raises(ValueError, match="bytes"):
        message_type("sensor_msgs/Range").codec.decode(short)


@pytest.mark.parametrize(
    ("service", "fields", "numbers"),
    [
        ("get_float", {"value": 1.0}, lambda answer: [answer.value]),
        (
            "node_get_position",
            {"position": {"x": 1.0, "y": 2.0, "z": 3.0}},
            lambda answer: [answer.position.x, answer.position.y, answer.position.z],
        ),
        ("get_float_array", {"value": [1.0, 2.0]}, lambda answer: list(answer.value)),
    ],
)
def test_each_float_of_an_answer_is_replaced(service, fields, numbers):
    """Floats inside points and lists are replaced too."""
    codec = service_type(f"webots_ros/{service}").response

    answer = damaged_answer(codec, b"\1" + frame(codec.encode(fields)), WRONG_VALUE)

    assert answer[:1] == b"\1"
    assert all(math.isnan(it) for it in numbers(codec.decode(payload(answer[1:]))))


def test_floats_of_messages_in_a_list_are_replaced_too():
    """An example is the response with a robot's contact points."""
    codec = service_type("webots_ros/node_get_contact_points").response
    sound = codec.encode({"contact_points": [{"node_id": 7}]})

    (point,) = codec.decode(
        payload(damaged_answer(codec, b"\1" + frame(sound), WRONG_VALUE)[1:])
    ).contact_points

    assert math.isnan(point.point.x)
    assert point.node_id == 7


@pytest.mark.parametrize(
    ("service", "fields"), [("set_int", {"success": True}), ("get_string", {"value": "robotino"})]
)
def test_an_answer_without_floats_keeps_its_values(service, fields):
    """Integers, booleans and texts cannot become NaN."""
    codec = service_type(f"webots_ros/{service}").response
    sound = b"\1" + frame(codec.encode(fields))

    assert damaged_answer(codec, sound, WRONG_VALUE) == sound


def test_an_answer_cut_short_is_a_whole_frame():
    """The length in front stays correct, even if the cut leaves nothing of a response of one byte."""
    codec = service_type("webots_ros/set_int").response

    assert damaged_answer(codec, b"\1" + frame(b"\1"), WRONG_SHAPE) == b"\1" + frame(b"")


@pytest.mark.parametrize("service", ["get_float", "get_string"])
def test_an_answer_cut_short_has_no_value_to_replace(service):
    """Both faults may apply to one response; after the cut, the bytes of its value may be missing."""
    codec = service_type(f"webots_ros/{service}").response
    sound = b"\1" + frame(codec.encode({}))

    short = damaged_answer(codec, sound, WRONG_SHAPE)

    assert damaged_answer(codec, sound, (*WRONG_SHAPE, *WRONG_VALUE)) == short


def test_a_failure_stays_as_it_is():
    """The text of a failed call is an error message and not data, so faults leave it alone."""
    codec = service_type("webots_ros/get_float").response
    failure = b"\0" + frame(b"no such node")

    assert damaged_answer(codec, failure, (*WRONG_VALUE, *WRONG_SHAPE)) == failure
