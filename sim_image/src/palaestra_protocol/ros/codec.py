"""Encode the values of a ROS message to bytes, and decode them.

A message of fixed size is packed with one precompiled struct. Any other message is written and read section
by section.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Any, Protocol

from palaestra_protocol.ros.fixed import UNFIT, Find, Record, has_fixed_size, record
from palaestra_protocol.ros.syntax import Message
from palaestra_protocol.ros.tcpros import LENGTH
from palaestra_protocol.ros.variable import Piece, Sections


class Codec(Protocol):
    """Encodes the values of one message to bytes, and decodes them."""

    def encode(self, fields: Mapping[str, Any]) -> bytes:
        """Return the bytes of a message; a field that is absent from `fields` is zero, empty or False.

        The value of a nested message is also a mapping, or a tuple of all fields of the nested message in
        order. `decode` returns such tuples.

        Raises:
            ValueError: a value does not fit its field.
        """
        ...

    def frame(self, fields: Mapping[str, Any]) -> bytes:
        """Return the bytes of a message, preceded by their length as TCPROS requires.

        Raises:
            ValueError: a value does not fit its field.
        """
        ...

    def decode(self, payload: bytes | memoryview) -> Any:
        """Return a named tuple of the fields; the field `from`, a keyword of Python, is called `from_`.

        An array of numbers is a tuple, or bytes for `uint8` and `char`. Any other array is a list. Bytes of a
        string that are not UTF-8 are replaced.

        Raises:
            ValueError: `payload` is not a message of this type.
        """
        ...


def codec_of(message: Message, find: Find) -> Codec:
    """Return the codec of a message.

    Args:
        message: the definition of the message.
        find: returns the definition of a nested message by its name.
    """
    if all(has_fixed_size(field, find) for field in message.fields):
        return _FixedCodec(message.name, record(message, message.fields, find))
    return _VariableCodec(message.name, Sections(message, find))


class _FixedCodec:
    """The codec of a message of fixed size: one precompiled struct."""

    def __init__(self, name: str, record: Record) -> None:
        self._name = name
        self._record = record
        self._struct = struct.Struct("<" + record.codes)
        self._framed = struct.Struct("<I" + record.codes)

    def encode(self, fields: Mapping[str, Any]) -> bytes:
        try:
            return self._struct.pack(*self._record.flatten(fields))
        except UNFIT as error:
            raise self._refusal(fields, error) from error

    def frame(self, fields: Mapping[str, Any]) -> bytes:
        try:
            return self._framed.pack(self._struct.size, *self._record.flatten(fields))
        except UNFIT as error:
            raise self._refusal(fields, error) from error

    def decode(self, payload: bytes | memoryview) -> Any:
        try:
            numbers = self._struct.unpack(payload)
        except struct.error as error:
            raise ValueError(f"{len(payload)} bytes instead of {self._struct.size}") from error
        return self._record.make(numbers) if self._record.flat else self._record.build(numbers)

    def _refusal(self, fields: Mapping[str, Any], error: Exception) -> ValueError:
        return ValueError(f"{self._name}: {self._record.unfit(fields)}: {error}")


class _VariableCodec:
    """The codec of a message with strings or lists."""

    def __init__(self, name: str, sections: Sections) -> None:
        self._name = name
        self._sections = sections

    def encode(self, fields: Mapping[str, Any]) -> bytes:
        return b"".join(self._pieces(fields))

    def frame(self, fields: Mapping[str, Any]) -> bytes:
        pieces = self._pieces(fields)
        return b"".join((LENGTH.pack(sum(map(len, pieces))), *pieces))

    def decode(self, payload: bytes | memoryview) -> Any:
        try:
            message, end = self._sections.read(bytes(payload), 0)
        except struct.error as error:
            raise ValueError(f"{len(payload)} bytes, which end in the middle of a field") from error
        if end != len(payload):
            raise ValueError(f"{len(payload)} bytes instead of {end}")
        return message

    def _pieces(self, fields: Mapping[str, Any]) -> list[Piece]:
        pieces: list[Piece] = []
        try:
            self._sections.write(fields, pieces)
        except UNFIT as error:
            raise ValueError(f"{self._name}: {error}") from error
        return pieces
