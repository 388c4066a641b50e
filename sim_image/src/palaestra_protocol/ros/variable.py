"""Messages with strings and lists, written and read section by section.

Consecutive fields of fixed size form one section, which one struct packs. Each string, each list, and each
nested message of variable size is a separate section.

Peers are not trusted. So the reader compares a length with the number of remaining bytes before it creates an
object of that length.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from typing import Any, Protocol

from palaestra_protocol.ros.fixed import (
    UNFIT,
    Find,
    Record,
    attribute,
    check_length,
    collection,
    has_fixed_size,
    maker,
    message_of,
    record,
)
from palaestra_protocol.ros.syntax import NUMBERS, Message, MessageField
from palaestra_protocol.ros.tcpros import LENGTH

Piece = bytes | memoryview  # a part of a message that is being written
_LENGTH_SIZE = LENGTH.size
_length_at = LENGTH.unpack_from


class _Layout(Protocol):
    """Writes and reads the bytes of one value."""

    @property
    def empty(self) -> Any:
        """Return the value of an absent field."""
        ...

    def write(self, value: Any, pieces: list[Piece]) -> None:
        """Append the bytes of a value."""
        ...

    def read(self, data: bytes, at: int) -> tuple[Any, int]:
        """Return the value that begins at offset `at`, and the offset of its end."""
        ...


class Sections:
    """Writes and reads a message with strings or lists.

    Args:
        message: the definition of the message.
        find: returns the definition of a nested message by its name.
    """

    empty: Mapping[str, Any] = {}

    def __init__(self, message: Message, find: Find) -> None:
        self._names = tuple(map(attribute, message.fields))
        self._known = frozenset(self._names)
        self._make = maker(message, message.fields)
        self._sections = tuple(_sections(message, find))
        self._reads = tuple((layout.read, isinstance(layout, _Packed)) for _, layout in self._sections)

    def write(self, value: Any, pieces: list[Piece]) -> None:
        """Append the bytes of a message to `pieces`.

        Args:
            value: the message, as a mapping, or as a tuple of all fields in order.
            pieces: the bytes written so far.

        Raises:
            ValueError: a value does not fit its field, or a name in `value` is not a field of the message.
        """
        fields = dict(zip(self._names, value, strict=True)) if isinstance(value, tuple) else value
        if not fields.keys() <= self._known:
            raise ValueError(f"the type has no field {', '.join(sorted(fields.keys() - self._known))}")
        for name, layout in self._sections:
            try:
                layout.write(fields if type(layout) is _Packed else fields.get(name, layout.empty), pieces)
            except UNFIT as error:
                field = layout.unfit(fields) if type(layout) is _Packed else name
                raise ValueError(f"{field}: {error}") from error

    def read(self, data: bytes, at: int) -> tuple[Any, int]:
        """Return the message that begins at offset `at`, and the offset of its end.

        Raises:
            ValueError, struct.error: the bytes are not such a message.
        """
        values: list[Any] = []
        for read, packed in self._reads:
            value, at = read(data, at)
            if packed:
                values += value
            else:
                values.append(value)
        return self._make(values), at


class _Packed:
    """Consecutive fields of fixed size."""

    empty: Mapping[str, Any] = {}

    def __init__(self, record: Record) -> None:
        self._record = record
        self._struct = struct.Struct("<" + record.codes)
        self.unfit = record.unfit

    def write(self, value: Any, pieces: list[Piece]) -> None:
        pieces.append(self._struct.pack(*self._record.flatten(value)))

    def read(self, data: bytes, at: int) -> tuple[Any, int]:
        numbers = self._struct.unpack_from(data, at)
        values = numbers if self._record.flat else self._record.build(numbers)
        return values, at + self._struct.size


class _Text:
    empty = ""

    def write(self, value: Any, pieces: list[Piece]) -> None:
        text = value.encode()
        pieces += LENGTH.pack(len(text)), text

    def read(self, data: bytes, at: int) -> tuple[Any, int]:
        start = at + _LENGTH_SIZE
        end = start + _length_at(data, at)[0]
        if end > len(data):
            raise _too_long(end - start, len(data) - start)
        return data[start:end].decode("utf-8", "replace"), end


class _Octets:
    """A list of `uint8` or `char`, as bytes; writing does not copy the bytes, because images are large."""

    empty = b""

    def write(self, value: Any, pieces: list[Piece]) -> None:
        if not isinstance(value, bytes | bytearray | memoryview | list | tuple):
            raise TypeError(f"{type(value).__name__} is not bytes or a list of numbers")
        octets = bytes(value) if isinstance(value, list | tuple) else memoryview(value).cast("B")
        pieces += LENGTH.pack(len(octets)), octets

    def read(self, data: bytes, at: int) -> tuple[Any, int]:
        start, end, _ = _counted(data, at, 1)
        return data[start:end], end


class _Numbers:
    """A list of numbers."""

    empty = ()

    def __init__(self, code: str) -> None:
        self._code = code
        self._size = struct.calcsize("<" + code)

    def write(self, value: Any, pieces: list[Piece]) -> None:
        pieces.append(struct.pack(f"<I{len(value)}{self._code}", len(value), *value))

    def read(self, data: bytes, at: int) -> tuple[Any, int]:
        start, end, count = _counted(data, at, self._size)
        return struct.unpack(f"<{count}{self._code}", data[start:end]), end


class _Records:
    """A list of messages of fixed size."""

    empty = ()

    def __init__(self, record: Record) -> None:
        self._record = record
        self._struct = struct.Struct("<" + record.codes)

    def write(self, value: Any, pieces: list[Piece]) -> None:
        pack, flatten = self._struct.pack, self._record.flatten
        pieces.append(LENGTH.pack(len(value)))
        pieces += [pack(*flatten(item)) for item in value]

    def read(self, data: bytes, at: int) -> tuple[Any, int]:
        start, end, _ = _counted(data, at, self._struct.size)
        rows = self._struct.iter_unpack(data[start:end])
        if self._record.flat:
            return list(map(self._record.make, rows)), end
        return list(map(self._record.build, rows)), end


class _Elements:
    """A list, or an array of fixed length, of strings or of messages of variable size."""

    def __init__(self, element: _Layout, length: int | None) -> None:
        self._element = element
        self._length = length
        self.empty: Sequence[Any] = [element.empty] * (length or 0)

    def write(self, value: Any, pieces: list[Piece]) -> None:
        if self._length is None:
            pieces.append(LENGTH.pack(len(value)))
        else:
            check_length(value, self._length)
        for item in value:
            self._element.write(item, pieces)

    def read(self, data: bytes, at: int) -> tuple[Any, int]:
        count = self._length
        if count is None:
            at, _, count = _counted(data, at, LENGTH.size)  # every element contains at least one length field
        items = []
        read = self._element.read
        for _ in range(count):
            item, at = read(data, at)
            items.append(item)
        return items, at


def _counted(data: bytes, at: int, size: int) -> tuple[int, int, int]:
    """Return the offset of a list's first element, the offset of its end, and the number of its elements.

    Each element has at least `size` bytes.

    Raises:
        ValueError, struct.error: the data ends before the end of the list.
    """
    (count,) = _length_at(data, at)
    start = at + _LENGTH_SIZE
    end = start + count * size
    if end > len(data):
        raise _too_long(count, len(data) - start)
    return start, end, count


def _too_long(count: int, left: int) -> ValueError:
    return ValueError(f"a length of {count}, but only {left} bytes are left")


def _sections(message: Message, find: Find) -> Iterator[tuple[str, _Layout]]:
    """Yield each section with the name of its field; the name is "" for fields of fixed size."""
    for is_fixed, group in groupby(message.fields, lambda field: has_fixed_size(field, find)):
        fields = list(group)
        if is_fixed:
            yield "", _Packed(record(message, fields, find))
        else:
            yield from ((attribute(field), _layout(field, find)) for field in fields)


def _layout(field: MessageField, find: Find) -> _Layout:
    """Return the layout of a field of variable size."""
    if field.type in NUMBERS:
        return _Octets() if collection(field.type) is bytes else _Numbers(NUMBERS[field.type])
    element: _Layout = _Text()
    if field.type != "string":
        inside = message_of(field.type, find)
        if all(has_fixed_size(it, find) for it in inside.fields):
            return _Records(record(inside, inside.fields, find))
        element = Sections(inside, find)
    return _Elements(element, field.length) if field.array else element
