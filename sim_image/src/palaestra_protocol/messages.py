"""JSON messages: one declaration of a field defines how the field is written and read.

A message is a dataclass. The annotation of a field has its type and a `ValueKind`, which has the bounds:

    phase: Annotated[str, Text(MOST_NAME, least=1)]
    mean_return: Annotated[float | None, Maybe(Number())] = None

The writer cuts a value to the bounds that the reader checks. So a long error text of a trainer does not make
its status unreadable. A reader of responses ignores unknown fields, because a newer release may add fields.
`JsonRequest` refuses unknown fields, because a misspelled field of a request must not be ignored.

Programs of different releases exchange messages, so each field has one of three kinds:

- `Maybe`: the writer always writes the field, as null if the value is unknown; a message of an older release
  may lack the field
- `AddedLater`: release 0.1.0 does not have the field, so the writer leaves it out unless it is set
- any other `ValueKind`: the writer always writes the field, and the reader refuses a message without it; a
  default in the class is only for programs that create messages

`palaestra_protocol.scene` has its own reader, which also checks references inside a message: for example,
from a shape to its mesh.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, ClassVar, Self, get_type_hints

from palaestra_protocol.fields import MOST_COUNT, MOST_TEXT, Fields, clipped, enumerated, known


class ValueKind(ABC):
    """The reader and the writer of a field's value.

    Attributes:
        required: whether a message without the field is refused.
    """

    __slots__ = ()
    required: ClassVar[bool] = True

    @abstractmethod
    def read(self, fields: Fields, name: str) -> Any:
        """Return the value of the field `name`.

        Raises:
            ProtocolError: the value has another type, or exceeds a bound.
        """

    def write(self, value: Any) -> Any:
        """Return the value as JSON data, cut to the bounds."""
        return value

    def absent(self, value: Any) -> bool:
        """Return whether the writer leaves out the field if it has this value."""
        del value
        return False


class JsonMessage:
    """A message, or a part of a message; its subclasses are dataclasses."""

    __slots__ = ()

    def to_json(self) -> dict[str, Any]:
        """Return the message as JSON data, with texts and lists cut to the lengths that a reader accepts."""
        values = ((name, kind, getattr(self, name)) for name, kind in _kinds(type(self)).items())
        return {name: kind.write(value) for name, kind, value in values if not kind.absent(value)}

    @classmethod
    def from_json(cls, content: object, path: str = "") -> Self:
        """Return the object that `to_json` wrote.

        Args:
            content: the result of `json.loads`.
            path: the path of the object, such as "simulators[1]"; "" for the whole body.

        Raises:
            ProtocolError: `content` does not have this format.
        """
        fields = Fields(content, path)
        present = ((name, kind) for name, kind in _kinds(cls).items() if kind.required or fields.has(name))
        return cls(**{name: kind.read(fields, name) for name, kind in present})


class JsonRequest(JsonMessage):
    """A message whose reader refuses unknown fields, because a misspelled field must not be ignored."""

    __slots__ = ()

    @classmethod
    def from_json(cls, content: object, path: str = "") -> Self:
        """Return the request.

        Raises:
            ProtocolError: `content` does not have this format, or has an additional field.
        """
        Fields(content, path).only(*_kinds(cls))
        return super().from_json(content, path)


_KINDS: dict[type[JsonMessage], Mapping[str, ValueKind]] = {}  # a cache: filled when a class is first used


def _kinds(message: type[JsonMessage]) -> Mapping[str, ValueKind]:
    """Return the `ValueKind` of each field of a message, by name, in the order of their declaration."""
    if message not in _KINDS:
        hints = get_type_hints(message, include_extras=True)
        _KINDS[message] = {name: hint.__metadata__[0] for name, hint in hints.items()}
    return _KINDS[message]


@dataclass(frozen=True, slots=True)
class Text(ValueKind):
    """Text of `least` to `most` characters; the writer cuts longer text and masks passwords in addresses."""

    most: int = MOST_TEXT
    least: int = 0

    def read(self, fields: Fields, name: str) -> str:
        """Return the text."""
        return fields.text(name, self.most, self.least)

    def write(self, value: str) -> str:
        """Return the first `most` characters."""
        return clipped(value, self.most)


@dataclass(frozen=True, slots=True)
class Whole(ValueKind):
    """An integer from `least` to `most`."""

    least: int = 0
    most: int = MOST_COUNT

    def read(self, fields: Fields, name: str) -> int:
        """Return the integer."""
        return fields.whole(name, self.least, self.most)


@dataclass(frozen=True, slots=True)
class Number(ValueKind):
    """A finite number from `least` to `most`; the writer writes infinities and NaN as null, for unknown."""

    least: float = -math.inf
    most: float = math.inf

    def read(self, fields: Fields, name: str) -> float:
        """Return the number."""
        return fields.number(name, self.least, self.most)

    def write(self, value: float) -> float | None:
        """Return the number; None for infinities and NaN."""
        return known(value)


class Flag(ValueKind):
    """True or false."""

    __slots__ = ()

    def read(self, fields: Fields, name: str) -> bool:
        """Return the flag."""
        return fields.flag(name)


class Time(ValueKind):
    """A time in RFC 3339, as text."""

    __slots__ = ()

    def read(self, fields: Fields, name: str) -> str:
        """Return the text."""
        return fields.time(name)


@dataclass(frozen=True, slots=True)
class Choice(ValueKind):
    """A member of `choices`."""

    choices: type[StrEnum]

    def read(self, fields: Fields, name: str) -> StrEnum:
        """Return the member."""
        return fields.choice(name, self.choices)

    def write(self, value: StrEnum) -> str:
        """Return the member's text."""
        return value.value


@dataclass(frozen=True, slots=True)
class ChoiceText(ValueKind):
    """The text of a member of `choices`."""

    choices: type[StrEnum]

    def read(self, fields: Fields, name: str) -> str:
        """Return the text."""
        return fields.choice(name, self.choices).value


@dataclass(frozen=True, slots=True)
class Part(ValueKind):
    """A nested message."""

    message: type[JsonMessage]

    def read(self, fields: Fields, name: str) -> JsonMessage:
        """Return the message."""
        return fields.part(name, self.message.from_json)

    def write(self, value: JsonMessage) -> dict[str, Any]:
        """Return the message as JSON data."""
        return value.to_json()


@dataclass(frozen=True, slots=True)
class PartList(ValueKind):
    """A list of messages; the writer writes only the first `most`."""

    message: type[JsonMessage]
    most: int

    def read(self, fields: Fields, name: str) -> tuple[JsonMessage, ...]:
        """Return the messages."""
        return fields.parts(name, self.message.from_json, self.most)

    def write(self, value: tuple[JsonMessage, ...]) -> list[dict[str, Any]]:
        """Return the messages as JSON data."""
        return [part.to_json() for part in value[: self.most]]


class NewestPartList(PartList):
    """A list of messages, the newest last; the writer writes only the last `most`."""

    __slots__ = ()

    def write(self, value: tuple[JsonMessage, ...]) -> list[dict[str, Any]]:
        """Return the messages as JSON data."""
        return [part.to_json() for part in value[-self.most :]]


@dataclass(frozen=True, slots=True)
class Lines(ValueKind):
    """A list of at most `most_entries` texts of at most `most` characters each.

    If the writer drops texts, the last entry has their number.
    """

    most: int
    most_entries: int

    def read(self, fields: Fields, name: str) -> tuple[str, ...]:
        """Return the texts."""
        return fields.texts(name, self.most, self.most_entries)

    def write(self, value: tuple[str, ...]) -> list[str]:
        """Return the first texts; if texts are dropped, the last entry has their number."""
        return enumerated(value, self.most, self.most_entries)


class NewestLines(Lines):
    """A list of texts, the newest last; the writer writes only the last `most_entries`."""

    __slots__ = ()

    def write(self, value: tuple[str, ...]) -> list[str]:
        """Return the last texts."""
        return [clipped(text, self.most) for text in value[-self.most_entries :]]


@dataclass(frozen=True, slots=True)
class Table(ValueKind):
    """Values of one kind, by name; the reader ignores names that are not in `rows`.

    A newer release may have added a name that this release does not know.
    """

    rows: Iterable[StrEnum]
    kind: ValueKind

    def read(self, fields: Fields, name: str) -> dict[str, Any]:
        """Return the values by name; a name that the message lacks is left out."""
        table = fields.part(name, Fields)
        return {row.value: self.kind.read(table, row.value) for row in self.rows if table.has(row.value)}

    def write(self, value: Mapping[str, Any]) -> dict[str, Any]:
        """Return the values as JSON data."""
        return {row: self.kind.write(cell) for row, cell in value.items()}


@dataclass(frozen=True, slots=True)
class Maybe(ValueKind):
    """A value that may be unknown: for a null or missing field, the reader uses the field's default."""

    kind: ValueKind
    required: ClassVar[bool] = False

    def read(self, fields: Fields, name: str) -> Any:
        """Return the value."""
        return self.kind.read(fields, name)

    def write(self, value: Any) -> Any:
        """Return the value as JSON data; None stays None."""
        return None if value is None else self.kind.write(value)


class AddedLater(Maybe):
    """A field that a release after 0.1.0 added; its default is None, and the writer leaves out None."""

    __slots__ = ()

    def absent(self, value: Any) -> bool:
        """Return whether the value is None."""
        return value is None
