"""Encoding and decoding of ROS messages: types of every form, and untrusted bytes."""

import math
import struct
from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palaestra_protocol.ros.codec import codec_of
from palaestra_protocol.ros.syntax import parse
from palaestra_protocol.ros.tcpros import frame
from tests.ros_values import MESSAGES, find, values

NAMES = sorted(MESSAGES)
CODECS = {name: codec_of(MESSAGES[name], find) for name in NAMES}
MORE = 2**32 - 1  # more elements than any message holds


def codec(text):
    """Return the codec of a definition."""
    return codec_of(parse("demo/Test", text), find)


def as_mapping(value):
    """Return a decoded value in the form that `encode` takes, with lists instead of tuples."""
    if hasattr(value, "_asdict"):
        return {name: as_mapping(field) for name, field in value._asdict().items()}
    return [as_mapping(it) for it in value] if isinstance(value, list | tuple) else value


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=30)
@given(data=st.data())
def test_every_value_survives_the_wire(name, data):
    """A subscriber must get numbers, texts, lists and nested messages of any size unchanged."""
    given_values = data.draw(values(MESSAGES[name], find, whole=True))

    assert as_mapping(CODECS[name].decode(CODECS[name].encode(given_values))) == given_values


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=30)
@given(data=st.data())
def test_absent_fields_are_zero_empty_or_false(name, data):
    """A ROS message always has all its fields, so `encode` adds those that the caller leaves out."""
    encoded = CODECS[name].encode(data.draw(values(MESSAGES[name], find)))

    assert CODECS[name].encode(CODECS[name].decode(encoded)._asdict()) == encoded


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=30)
@given(data=st.data())
def test_a_frame_is_the_length_and_the_message(name, data):
    """`frame` packs length and message in one call where that is faster; the bytes must be the same."""
    given_values = data.draw(values(MESSAGES[name], find))

    assert CODECS[name].frame(given_values) == frame(CODECS[name].encode(given_values))


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=30)
@given(data=st.data())
def test_a_message_cut_short_or_too_long_is_refused(name, data):
    """A message of another version of its type must not be read as a wrong value."""
    encoded = CODECS[name].encode(data.draw(values(MESSAGES[name], find)))

    with pytest.raises(ValueError, match="bytes"):
        CODECS[name].decode(encoded + b"\0")
    if encoded:
        with pytest.raises(ValueError, match="bytes"):
            CODECS[name].decode(encoded[: data.draw(st.integers(0, len(encoded) - 1))])


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=30)
@given(payload=st.binary(max_size=200))
def test_bytes_of_strangers_are_a_message_or_a_value_error(name, payload):
    """Bytes from another program must cause no other error than ValueError."""
    with suppress(ValueError):
        CODECS[name].decode(memoryview(payload))


@pytest.mark.parametrize(
    "field", ["string", "string[]", "uint8[]", "float64[]", "demo/Point[]", "demo/Named[]", "time[]"]
)
def test_a_length_that_the_payload_does_not_bear_out_is_refused(field):
    """Four bytes of a wrong length must not make the reader allocate gigabytes or loop for hours."""
    with pytest.raises(ValueError, match=f"a length of {MORE}, but only 8 bytes are left"):
        codec(f"{field} value").decode(struct.pack("<IQ", MORE, 0))


def test_fields_have_the_names_of_the_definition_and_python_s_own_get_an_underscore():
    """A field of the definition may be named `from`, which is a keyword of Python."""
    message = codec("uint64 from\ndemo/Named[] named\nduration late")

    decoded = message.decode(
        message.encode({"from_": 3, "named": [{"point": {"y": 2.5}}], "late": {"secs": -1}})
    )

    assert (decoded.from_, decoded.named[0].point.y) == (3, 2.5)
    assert (decoded.late.secs, decoded.late.nsecs) == (-1, 0)


def test_bytes_numbers_and_flags_have_types_of_their_own():
    """Lists of numbers are tuples, so no subscriber can change a message that another one gets too."""
    message = codec("uint8[] a\nchar[2] b\nbyte[] c\nfloat32[2] d\nbool[] e\nbool f")

    decoded = message.decode(
        message.encode({"a": [1, 2], "b": b"xy", "c": [-1], "d": (0.5, 2), "e": [1, 0], "f": 1})
    )

    assert decoded == (b"\1\2", b"xy", (-1,), (0.5, 2.0), (True, False), True)
    assert type(decoded.e[0]) is type(decoded.f) is bool


def test_pixels_are_written_from_the_memory_in_which_they_were_drawn():
    """A picture has a million bytes, so `frame` copies them only once."""
    message = codec("string name\nuint8[] data")
    pixels = memoryview(bytearray(range(12))).cast("B", (3, 4))

    framed = message.frame({"name": "eye", "data": pixels})

    assert framed == frame(message.encode({"name": "eye", "data": bytes(range(12))}))


def test_a_message_inside_may_be_a_tuple_of_its_fields():
    """A point cloud has ten thousand points; a mapping for each would take too long."""
    message = codec("demo/Point[] points\ndemo/Named named")
    mapping = {"points": [{"x": 1.0, "y": 2.0}], "named": {"name": "a", "point": {"x": 3.0}}}

    encoded = message.encode({"points": [(1.0, 2.0)], "named": ("a", (3.0, 0.0), b"")})

    assert encoded == message.encode(mapping)


def test_characters_that_are_not_utf_8_are_replaced():
    """As in genpy, a text in another encoding must not end the subscriber."""
    message = codec("string text")

    assert message.decode(frame("é".encode("latin-1") + b"x")).text == "\ufffdx"


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("uint8 value", 256),
        ("uint8 value", -1),
        ("int32 value", 1.0),
        ("int32 value", "1"),
        ("int32 value", None),
        ("float32 value", 1e300),
        ("float64 value", "1"),
        ("string value", b"text"),
        ("string value", None),
        ("string value", "\ud800"),
        ("string[] value", [1]),
        ("uint8[] value", "text"),
        ("uint8[] value", 3),
        ("uint8[] value", [256]),
        ("char[2] value", b"abc"),
        ("float64[] value", 1.0),
        ("float64[] value", ["1"]),
        ("float64[3] value", [1.0, 2.0]),
        ("string[2] value", ["one"]),
        ("demo/Point value", 1.0),
        ("demo/Point value", (1.0, 2.0, 3.0)),
        ("demo/Point[2] value", [(1.0,), (2.0, 3.0, 4.0)]),
        ("demo/Point[] value", [1.0]),
        ("demo/Named value", "a"),
        ("demo/Named value", ("a",)),
        ("demo/Named value", {"place": {}}),
        ("time value", 1.5),
        ("time value", {"secs": -1}),
    ],
)
def test_a_value_that_does_not_fit_its_field_is_refused(text, value):
    """Python raises various errors for such values; the message always names the type and the field."""
    for method in (codec(text).encode, codec(text).frame):
        with pytest.raises(ValueError, match=r"demo/Test: value: "):
            method({"value": value})


@pytest.mark.parametrize("message", [(256, 1), (1, 2, 3), (1,)])
def test_a_tuple_that_does_not_fit_is_refused_with_all_fields(message):
    """The numbers of a tuple have no names, so the message names the fields that it should have."""
    with pytest.raises(ValueError, match="demo/Test: first, second: "):
        codec("uint8 first\nuint8 second").encode(message)


def test_a_field_that_the_type_does_not_have_is_refused():
    """A mistyped field name would otherwise send an empty value."""
    with pytest.raises(ValueError, match="demo/Test: the type has no field vale"):
        codec("string value").encode({"vale": "text"})


def test_not_a_number_survives_the_wire():
    """Sensors without a reading send NaN."""
    message = codec("float32 value")

    assert math.isnan(message.decode(message.encode({"value": math.nan})).value)
