"""Messages of fixed size: one struct packs all values of a message, as a flat sequence of numbers.

Every motor command and every step is such a message, so the speed of this code limits the speed of a
simulator.
"""

from __future__ import annotations

import collections
import keyword
import struct
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import accumulate
from typing import Any, Protocol

from palaestra_protocol.ros.syntax import NUMBERS, Message, MessageField, parse

TIMES = {
    "time": parse("time", "uint32 secs\nuint32 nsecs"),
    "duration": parse("duration", "int32 secs\nint32 nsecs"),
}

# The exceptions that Python raises for a value that does not fit its field.
UNFIT = (AttributeError, OverflowError, TypeError, ValueError, struct.error)

Find = Callable[[str], Message]


class FixedPart(Protocol):
    """A field of fixed size that holds more than one number."""

    @property
    def codes(self) -> str:
        """Return the format codes of the field's numbers, for `struct`."""
        ...

    @property
    def empty(self) -> Any:
        """Return the value of an absent field."""
        ...

    def flatten(self, value: Any) -> Iterable[Any]:
        """Return the numbers of a value."""
        ...

    def build(self, numbers: Sequence[Any], at: int) -> Any:
        """Return the value whose numbers begin at index `at`."""
        ...


@dataclass(frozen=True, slots=True)
class Record:
    """A message of fixed size, or some consecutive fields of a message.

    Attributes:
        names: the name of each field, in the order of their bytes.
        parts: the `FixedPart` of each field; None if the field is one number.
        placed: for each field, its entry in `parts`, and the index of its first number in the flat sequence.
        empties: the value that each field has if it is absent.
        codes: the format codes of all numbers, in order.
        make: makes a named tuple of the values.
        flat: whether every field is one number.
    """

    names: tuple[str, ...]
    parts: tuple[FixedPart | None, ...]
    placed: tuple[tuple[FixedPart | None, int], ...]
    empties: tuple[Any, ...]
    codes: str
    make: Callable[[Iterable[Any]], Any]
    flat: bool

    @property
    def empty(self) -> Mapping[str, Any]:
        """Return a message without any field."""
        return {}

    def flatten(self, value: Any) -> Iterable[Any]:
        """Return the numbers of a message, given as a mapping, or as a tuple of all fields in order."""
        if isinstance(value, tuple):
            check_length(value, len(self.names))
            values: Iterable[Any] = value
        else:
            values = map(value.get, self.names, self.empties)
        if self.flat:
            return values
        numbers: list[Any] = []
        for part, field in zip(self.parts, values, strict=False):
            if part is None:
                numbers.append(field)
            else:
                numbers += part.flatten(field)
        return numbers

    def build(self, numbers: Sequence[Any], at: int = 0) -> Any:
        """Return the message whose numbers begin at index `at`."""
        if self.flat:
            return self.make(numbers[at : at + len(self.names)])
        return self.make(
            [part.build(numbers, at + place) if part else numbers[at + place] for part, place in self.placed]
        )

    def unfit(self, fields: Mapping[str, Any]) -> str:
        """Return the name of the first field whose value does not fit; pack each field separately."""
        for name in filter(fields.__contains__, self.names):
            try:
                struct.pack(f"<{self.codes}", *self.flatten({name: fields[name]}))
            except UNFIT:
                return name
        return ", ".join(self.names)


class _Array:
    """An array of fixed length, of numbers or of messages of fixed size."""

    def __init__(self, field: MessageField, length: int, element: FixedPart | None) -> None:
        self._element = element
        self._length = length
        self._collect = collection(field.type)
        self.codes = length * (NUMBERS[field.type] if element is None else element.codes)
        self.empty = self._collect([0] * length) if element is None else [element.empty] * length

    def flatten(self, value: Sequence[Any]) -> Iterable[Any]:
        check_length(value, self._length)
        if self._element is None:
            return value
        return [number for item in value for number in self._element.flatten(item)]

    def build(self, numbers: Sequence[Any], at: int) -> Any:
        if self._element is None:
            return self._collect(numbers[at : at + self._length])
        size = len(self._element.codes)
        return [self._element.build(numbers, at + index * size) for index in range(self._length)]


def collection(type_: str) -> Callable[[Iterable[Any]], Sequence[Any]]:
    """Return the constructor for an array of that type: bytes for `uint8` and `char`, else a tuple."""
    return bytes if NUMBERS.get(type_) == "B" else tuple


def check_length(value: Sequence[Any], length: int) -> None:
    """Check the number of elements of an array.

    Raises:
        ValueError: the number of elements is not `length`.
    """
    if len(value) != length:
        raise ValueError(f"{len(value)} elements instead of {length}")


def attribute(field: MessageField) -> str:
    """Return the attribute name of a field; as in genpy, a field called `from` becomes `from_`."""
    return field.name + "_" * keyword.iskeyword(field.name)


def maker(message: Message, fields: Sequence[MessageField]) -> Callable[[Iterable[Any]], Any]:
    """Return a function that makes a named tuple of the values of these fields."""
    name = message.name.rpartition("/")[2]
    names = tuple(map(attribute, fields))
    made: Any = collections.namedtuple(name, names)  # type: ignore[misc]  # noqa: PYI024 - a run-time name
    return partial(tuple.__new__, made)


def message_of(type_: str, find: Find) -> Message:
    """Return the definition of a message type; the built-in types `time` and `duration` count as messages."""
    return TIMES.get(type_) or find(type_)


def record(message: Message, fields: Sequence[MessageField], find: Find) -> Record:
    """Return the record of `fields`, which all have a fixed size and belong to `message`."""
    parts = tuple(_part(field, find) for field in fields)
    codes = [part.codes if part else NUMBERS[field.type] for field, part in zip(fields, parts, strict=True)]
    return Record(
        names=tuple(map(attribute, fields)),
        parts=parts,
        placed=tuple(zip(parts, accumulate(map(len, codes), initial=0), strict=False)),
        empties=tuple(part.empty if part else 0 for part in parts),
        codes="".join(codes),
        make=maker(message, fields),
        flat=not any(parts),
    )


def has_fixed_size(field: MessageField, find: Find) -> bool:
    """Return whether all values of a field have the same number of bytes."""
    if field.array == "[]" or field.type == "string":
        return False
    return field.type in NUMBERS or all(
        has_fixed_size(it, find) for it in message_of(field.type, find).fields
    )


def _part(field: MessageField, find: Find) -> FixedPart | None:
    element: FixedPart | None = None
    if field.type not in NUMBERS:
        inside = message_of(field.type, find)
        element = record(inside, inside.fields, find)
    return element if field.length is None else _Array(field, field.length, element)
