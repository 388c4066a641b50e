"""ROS messages with every type of field, and Hypothesis strategies for the values of any message."""

import struct

from hypothesis import strategies as st

from palaestra_protocol.ros.fixed import attribute
from palaestra_protocol.ros.syntax import NUMBERS, parse

NANOSECONDS = st.integers(0, 999_999_999)
STRINGS = st.text(max_size=8)
TIMES = {
    "time": st.fixed_dictionaries({"secs": st.integers(0, 2**32 - 1), "nsecs": NANOSECONDS}),
    "duration": st.fixed_dictionaries({"secs": st.integers(-(2**31), 2**31 - 1), "nsecs": NANOSECONDS}),
}

TEXTS = {
    "std_msgs/Header": "uint32 seq\ntime stamp\nstring frame_id\n",
    "demo/Point": "float64 x\nfloat64 y\n",
    "demo/Segment": "Point[2] ends\ntime stamp\n",
    "demo/Named": "# A point with a name.\nstring name\ndemo/Point point\nuint8[] data\n",
    "demo/Numbers": "\n".join(f"{type_} {type_}_" for type_ in NUMBERS),
    "demo/Arrays": "\n".join(f"{it} {it}_\n{it}[] many_{it}\n{it}[3] three_{it}" for it in NUMBERS),
    "demo/Everything": """\
        # Constants are not fields, but part of the md5.
int32 FIRST=1 # the first
string GREETING=hello # world
float64 HALF =  0.5

Header header  # by its short name
bool from
time stamp
duration lambda
time[] times
duration[2] durations
Point point
Point[] points
Point[2] pair
Segment segment
Segment[] segments
Named named
Named[] list
Named[2] two
string   text
string[] texts
string[2] two_texts
int32 last
""",
    "demo/Nothing": "",
}
MESSAGES = {name: parse(name, text) for name, text in TEXTS.items()}
find = MESSAGES.__getitem__


def values(message, find_nested, *, whole=False):
    """Return a strategy for the values of a message, as mappings; with `whole`, no field is absent."""
    fields = {attribute(field): _values_of(field, find_nested, whole=whole) for field in message.fields}
    return st.fixed_dictionaries(fields) if whole else st.fixed_dictionaries({}, optional=fields)


def _values_of(field, find_nested, *, whole):
    length = field.length
    fewest, most = (0, 3) if length is None else (length, length)
    if NUMBERS.get(field.type) == "B" and field.array:
        return st.binary(min_size=fewest, max_size=most)
    one = _one(field.type, find_nested, whole=whole)
    return st.lists(one, min_size=fewest, max_size=most) if field.array else one


def _one(type_, find_nested, *, whole):
    if type_ in NUMBERS:
        return _numbers(type_)
    if type_ == "string":
        return STRINGS
    if type_ in TIMES:
        return TIMES[type_]
    return values(find_nested(type_), find_nested, whole=whole)


def _numbers(type_):
    if type_ == "bool":
        return st.booleans()
    if type_.startswith("float"):
        return st.floats(width=int(type_.removeprefix("float")), allow_nan=False)
    bits = 8 * struct.calcsize("<" + NUMBERS[type_])
    signed = NUMBERS[type_].islower()
    return st.integers(-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if signed else st.integers(0, 2**bits - 1)
