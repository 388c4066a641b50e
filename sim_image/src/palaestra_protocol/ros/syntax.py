"""The parser for the text of a ROS message: its fields and constants.

The parser follows the rules of ROS's own parser, even surprising rules. For example, the value of a constant
of type `string` is the rest of its line, so a `#` in that line does not begin a comment.
Source: http://wiki.ros.org/msg
"""

from __future__ import annotations

import re
from dataclasses import dataclass

# The built-in types whose value is one number, with their format codes for `struct`.
NUMBERS = {
    "bool": "?",
    "int8": "b",
    "byte": "b",
    "uint8": "B",
    "char": "B",
    "int16": "h",
    "uint16": "H",
    "int32": "i",
    "uint32": "I",
    "int64": "q",
    "uint64": "Q",
    "float32": "f",
    "float64": "d",
}
BUILT_IN = frozenset({*NUMBERS, "string", "time", "duration"})

_FIELD = re.compile(r"([A-Za-z][\w/]*)(?:\[(\d*)\])?\s+([A-Za-z]\w*)", re.ASCII)


@dataclass(frozen=True, slots=True)
class MessageField:
    """One field of a message.

    Attributes:
        type: the type of the field, or of one element of an array: a built-in type, or `package/Name`.
        array: "" for a field that is not an array, `[]` for a list of any length, or a length such as `[9]`.
        name: the name in the text, even if it is a keyword of Python.
    """

    type: str
    array: str
    name: str

    @property
    def length(self) -> int | None:
        """The number of elements of an array of fixed length; None for any other field."""
        return int(self.array[1:-1]) if len(self.array) > len("[]") else None


@dataclass(frozen=True, slots=True)
class Message:
    """The definition of a message.

    Attributes:
        name: `package/Name`.
        text: the source text of the definition.
        constants: a line for each constant, in the form that the md5 sum covers.
        fields: the fields, in the order of their bytes.
    """

    name: str
    text: str
    constants: tuple[str, ...]
    fields: tuple[MessageField, ...]


def parse(name: str, text: str) -> Message:
    """Return the definition of the message `name`, parsed from its text.

    Raises:
        ValueError: a line is neither a field nor a constant.
    """
    constants, fields = [], []
    for line in text.split("\n"):
        bare = line.partition("#")[0].strip()
        if "=" in bare:
            constants.append(_constant(name, line, bare))
        elif bare:
            fields.append(_field(name, bare))
    return Message(name, text, tuple(constants), tuple(fields))


def _constant(message: str, line: str, bare: str) -> str:
    type_ = bare.split(maxsplit=1)[0]
    if type_ == "string":
        name, _, value = line.partition(" ")[2].partition("=")
    else:
        name, _, value = (part.strip() for part in bare.removeprefix(type_).partition("="))
    if type_ not in NUMBERS and type_ != "string":
        raise ValueError(f"{message}: {bare!r} is not a constant; its type must be a number or string")
    return f"{type_} {name}={value.strip()}"


def _field(message: str, bare: str) -> MessageField:
    found = _FIELD.fullmatch(bare)
    if found is None:
        raise ValueError(f"{message}: {bare!r} is not a field; write a type, a space and a name")
    type_, length, name = found.groups()
    return MessageField(_resolved(type_, message), "" if length is None else f"[{length}]", name)


def _resolved(type_: str, message: str) -> str:
    """Return a type name with its package; a name without a package means the package of the message."""
    if type_ == "Header":
        return "std_msgs/Header"
    if type_ in BUILT_IN or "/" in type_:
        return type_
    return f"{message.partition('/')[0]}/{type_}"
