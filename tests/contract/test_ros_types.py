"""The ROS types equal those of webots_ros, because other nodes reject different types."""

import json
from pathlib import Path

import pytest

from palaestra_protocol.ros.definitions import type_names
from palaestra_protocol.ros.rostypes import message_type, service_type
from palaestra_protocol.ros.tcpros import frame
from tests.tables import for_each

MD5 = json.loads(Path(__file__).with_name("ros_md5.json").read_text())
MESSAGES, SERVICES = type_names()


@for_each("name", sorted(MD5))
def test_every_type_of_webots_ros_has_its_md5(name):
    """Before the first byte of data, two nodes compare the md5 sums of their definitions.

    If the sums differ, the nodes do not connect.
    """
    type_ = message_type(name) if name in MESSAGES else service_type(name)

    assert type_.md5 == MD5[name]


@for_each("name", MESSAGES)
def test_an_empty_message_survives_the_wire(name):
    """In ROS, a field that is not set is sent as zero, as an empty value or as False, and not left out."""
    codec = message_type(name).codec

    sent = codec.encode({})

    assert codec.encode(codec.decode(sent)) == sent


@for_each("name", SERVICES)
def test_request_and_response_of_every_service_survive_the_wire(name):
    """An error in the types of a service would otherwise appear only at the first call."""
    type_ = service_type(name)

    for codec in (type_.request, type_.response):
        codec.decode(memoryview(codec.encode({})))
        assert codec.frame({}) == frame(codec.encode({}))


def test_fields_are_named_as_in_the_definition():
    """The simulators' handlers and the trainer's facades use these names."""
    codec = service_type("webots_ros/field_set_vec3f").request

    request = codec.decode(codec.encode({"field": 7, "index": -1, "value": {"x": 1.5, "z": -2.0}}))

    assert (request.field, request.index, request.value.x, request.value.z) == (7, -1, 1.5, -2.0)


def test_a_field_that_python_reserves_gets_an_underscore():
    """The library genpy does the same, because `from` cannot be the name of an attribute."""
    codec = service_type("webots_ros/node_set_visibility").request

    assert codec.decode(codec.encode({"from_": 3})).from_ == 3


def test_bytes_of_another_length_are_refused():
    """The message of a node with another definition must not be read as zeros."""
    with pytest.raises(ValueError, match="3 bytes instead of 4"):
        service_type("webots_ros/set_int").request.decode(b"abc")
