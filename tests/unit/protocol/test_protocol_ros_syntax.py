"""The parser of message definitions as people write them."""

import pytest

from palaestra_protocol.ros.syntax import MessageField, parse


def test_fields_are_read_with_their_types_in_full():
    """A type without a package is in the message's own package, except `Header` of std_msgs."""
    text = "Header header\nPoint[] points\nsensor_msgs/Image image\nfloat64[9] covariance  # row by row\n"

    assert parse("demo/Path", text).fields == (
        MessageField("std_msgs/Header", "", "header"),
        MessageField("demo/Point", "[]", "points"),
        MessageField("sensor_msgs/Image", "", "image"),
        MessageField("float64", "[9]", "covariance"),
    )


def test_an_array_has_a_length_only_if_it_is_fixed():
    """Only fixed arrays have their length in the type; other arrays carry their length on the wire."""
    fields = parse("demo/Arrays", "int8 one\nint8[] any\nint8[0] none\nint8[12] dozen").fields

    assert [field.length for field in fields] == [None, None, 0, 12]


@pytest.mark.parametrize(
    ("line", "constant"),
    [
        ("uint8 INFRARED=1", "uint8 INFRARED=1"),
        ("  int32   LOW  =  -5  # the least", "int32 LOW=-5"),
        ("string NAME= a # b ", "string NAME=a # b"),
    ],
)
def test_a_constant_is_kept_as_the_md5_covers_it(line, constant):
    """Spaces and comments are removed; in a string constant, `#` does not begin a comment."""
    message = parse("demo/Constants", line)

    assert message.constants == (constant,)
    assert message.fields == ()


@pytest.mark.parametrize("line", ["int32", "int32 a b", "int32[x] a", "int32 a-b", "int32[2][2] a", "2 a"])
def test_a_line_that_is_no_field_is_refused(line):
    """If the parser skipped the line, it would read all later fields at a wrong position."""
    with pytest.raises(ValueError, match=r"demo/Wrong: .* is not a field; write a type, a space and a name"):
        parse("demo/Wrong", line)


def test_a_constant_of_a_message_is_refused():
    """The syntax of a constant is one line, so only numbers and strings are possible."""
    with pytest.raises(
        ValueError, match="demo/Wrong: 'time NOW=1' is not a constant; its type must be a number"
    ):
        parse("demo/Wrong", "time NOW=1")
