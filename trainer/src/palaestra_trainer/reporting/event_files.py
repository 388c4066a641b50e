"""Read scalars from the bytes of TensorBoard's event files.

Palaestra has its own reader, because TensorBoard's reader takes a second to import. If a kill left
an incomplete record at the end of a file, the reader skips this record. Source of the format:
tensorflow/core/util/event.proto and summary.proto, tensorflow/core/lib/io/record_writer.h.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

# Bytes of the header (a length and its checksum), and of the checksum of the content.
_HEADER, _CHECKSUM = 12, 4
_VARINT, _FIXED64, _BYTES, _FIXED32 = 0, 1, 2, 5
_STEP, _SUMMARY, _SESSION = 2, 5, 7  # fields of Event
_VALUE = 1  # field of Summary
_TAG, _SIMPLE = 1, 2  # fields of Summary.Value
_STATUS, _START = 1, 1  # field of SessionLog, and its value for a start

LONGEST_BITS = 63  # an integer has at most 10 bytes of 7 bits

Scalars = dict[str, dict[int, float]]


def add_scalars(content: bytes, found: Scalars) -> None:
    """Add the scalars of one event file to `found`, which has those of earlier files by name and step.

    If the file records the start of a session at a step, scalars of earlier files at this step and later
    steps are removed.
    """
    for record in _records(content):
        try:
            _add(record, found)
        except (IndexError, struct.error, UnicodeDecodeError, ValueError):
            continue


def _records(content: bytes) -> Iterator[bytes]:
    at = 0
    while at + _HEADER <= len(content):
        (size,) = struct.unpack_from("<Q", content, at)
        start = at + _HEADER
        if start + size + _CHECKSUM > len(content):
            return
        yield content[start : start + size]
        at = start + size + _CHECKSUM


def _add(record: bytes, found: Scalars) -> None:
    step, values, starts = 0, list[bytes](), False
    for number, value in _fields(record):
        if number == _STEP and isinstance(value, int):
            step = value
        elif number == _SUMMARY and isinstance(value, bytes):
            values += [part for field, part in _fields(value) if field == _VALUE and isinstance(part, bytes)]
        elif number == _SESSION and isinstance(value, bytes):
            starts = (_STATUS, _START) in list(_fields(value))
    if starts:
        for points in found.values():
            for later in [known for known in points if known >= step]:
                del points[later]
    for value in values:
        parts = dict(_fields(value))
        tag, number_ = parts.get(_TAG), parts.get(_SIMPLE)
        if isinstance(tag, bytes) and isinstance(number_, float):
            found.setdefault(tag.decode(), {})[step] = number_


def _fields(message: bytes) -> Iterator[tuple[int, int | float | bytes]]:
    """Yield number and value of each field of a protobuf message, except for 64-bit values."""
    at = 0
    while at < len(message):
        key, at = _varint(message, at)
        kind = key & 7
        if kind == _VARINT:
            value, at = _varint(message, at)
            yield key >> 3, value
        elif kind == _BYTES:
            size, at = _varint(message, at)
            if at + size > len(message):
                raise ValueError("a field is longer than its message")
            yield key >> 3, message[at : at + size]
            at += size
        elif kind == _FIXED32:
            (number,) = struct.unpack_from("<f", message, at)
            yield key >> 3, float(number)
            at += 4
        elif kind == _FIXED64:
            at += 8
        else:
            raise ValueError("a field has a type that events do not use")


def _varint(message: bytes, at: int) -> tuple[int, int]:
    """Return the integer at a position, and the position after the integer."""
    value = shift = 0
    while True:
        byte = message[at]
        value |= (byte & 0x7F) << shift
        at, shift = at + 1, shift + 7
        if not byte & 0x80:
            return value, at
        if shift > LONGEST_BITS:
            raise ValueError("an integer has too many bytes")
