"""Palaestra's codecs and digests agree with the libraries genpy and genmsg of ROS."""

import io
from functools import cache

import genmsg.gentools
import genmsg.msg_loader
import genpy
import genpy.dynamic
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palaestra_protocol.ros import definitions, digests
from palaestra_protocol.ros.codec import codec_of
from palaestra_protocol.ros.fixed import attribute
from tests import ros_values
from tests.tables import for_each

NAMES, SERVICES = (
    (*ours, *common)
    for ours, common in zip(definitions.type_names(), definitions.common_type_names(), strict=True)
)
SIDES = {side.name: side for name in SERVICES for side in definitions.service(name)}
TYPES = {
    **{name: (message, ros_values.find) for name, message in ros_values.MESSAGES.items()},
    **{name: (definitions.message(name), definitions.message) for name in NAMES},
    **{name: (side, definitions.message) for name, side in SIDES.items()},
}


@cache
def classes(name):
    """Return genpy's classes for a message and its nested messages, by name."""
    message, find = TYPES[name]
    return genpy.dynamic.generate_dynamic(name, digests.full_text(find, message))


def instance(name, type_, values):
    """Return genpy's object with these values, for the type `name` or for a message nested in it."""
    if type_ in ("time", "duration"):
        made = {"time": genpy.Time, "duration": genpy.Duration}[type_]()
        for field, value in values.items():
            setattr(made, field, value)
        return made
    if not isinstance(values, dict):
        return values
    made = classes(name)[type_]()
    message, find = TYPES[name]
    for field in (message if type_ == name else find(type_)).fields:
        if attribute(field) in values:
            value = values[attribute(field)]
            many = field.array and not isinstance(value, bytes)
            built = [instance(name, field.type, it) for it in value] if many else None
            setattr(made, attribute(field), built if many else instance(name, field.type, value))
    return made


def plain(value):
    """Return a decoded value of either library in a form that Python can compare."""
    if isinstance(value, bytes | str):
        return value
    names = getattr(value, "_fields", getattr(value, "__slots__", None))
    if names is not None:
        return {name: plain(getattr(value, name)) for name in names}
    return [plain(it) for it in value] if isinstance(value, list | tuple) else value


@for_each("name", sorted(TYPES))
@settings(max_examples=10)
@given(data=st.data())
def test_bytes_and_values_are_those_of_genpy(name, data):
    """A client with rospy must be able to read our bytes, and we must be able to read its bytes."""
    message, find = TYPES[name]
    codec = codec_of(message, find)
    values = data.draw(ros_values.values(message, find))
    buffer = io.BytesIO()
    theirs = instance(name, name, values)
    theirs.serialize(buffer)

    ours = codec.encode(values)

    assert ours == buffer.getvalue()
    assert plain(codec.decode(ours)) == plain(classes(name)[name]().deserialize(ours))


@for_each("name", sorted(TYPES))
def test_md5_and_text_are_those_of_genmsg(name):
    """A subscriber compares the md5 sum, and rosbag and rostopic read the text of the definition."""
    message, find = TYPES[name]
    context = genmsg.MsgContext.create_default()
    for nested in (*ros_values.TEXTS, *NAMES):
        text = TYPES[nested][0].text
        genmsg.msg_loader.load_msg_from_string(context, text, nested)
    spec = genmsg.msg_loader.load_msg_from_string(context, message.text, name)
    genmsg.msg_loader.load_depends(context, spec, {})

    assert digests.md5(find, message) == genmsg.gentools.compute_md5(context, spec)
    assert digests.full_text(find, message) == genmsg.gentools.compute_full_text(context, spec)


@pytest.mark.parametrize("value", [-1, 2**8, 1.5, "1", None])
def test_what_genpy_refuses_for_a_number_we_refuse(value):
    """A number that is wrapped or rounded would move the robot to a wrong place."""
    name = "webots_ros/field_set_boolRequest"
    message, find = TYPES[name]

    with pytest.raises(genpy.SerializationError):
        instance(name, name, {"value": value}).serialize(io.BytesIO())
    with pytest.raises(ValueError, match="webots_ros/field_set_boolRequest: "):
        codec_of(message, find).encode({"value": value})
