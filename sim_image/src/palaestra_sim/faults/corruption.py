"""Change the bytes of messages and responses, as a fault requires.

Pure: bytes in, bytes out. The length prefix of a message stays correct, so a client can still find the next
message in the stream.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

from palaestra_protocol.ros.rostypes import Codec, message_type, reading_field
from palaestra_protocol.ros.tcpros import LENGTH, frame
from palaestra_sim.faults.fault_state import Damage
from palaestra_sim.faults.kinds import WrongValue

_FRACTIONS = frozenset("fd")  # the format codes of floats in `struct`
_FLOAT32 = struct.Struct("<f")


def damaged_message(type_name: str, data: bytes, damages: Sequence[Damage], field: str = "") -> bytes:
    """Return a framed message of a topic, changed by all `damages`.

    Args:
        type_name: the type of the message, as `package/Name`.
        data: the framed message: four bytes with its length, then its bytes.
        damages: the faults to apply, in this order.
        field: the field with the sensor's reading; "" means the last field.
    """
    payload = data[LENGTH.size :]
    reading = reading_field(type_name, field) if type_name else None
    for damage in damages:
        if not isinstance(damage, WrongValue):
            payload = payload[: len(payload) // 2]
        elif reading is None:
            payload = _with_reading_of_any_size(payload, type_name, field, damage.value)
        elif len(payload) >= reading[0].size + reading[1]:
            payload = _with_reading(payload, *reading, damage.value)
    return frame(payload)


def _with_reading_of_any_size(payload: bytes, type_name: str, field: str, value: float) -> bytes:
    """Return `payload` with `value` in place of each float of its reading, which has a variable size.

    If the reading is a field of bytes, such as the data of a depth image, each float32 in it is replaced.
    """
    if not type_name or not field:
        return payload
    codec = message_type(type_name).codec
    try:
        fields = codec.decode(payload)._asdict()
    except ValueError:  # an earlier corruption may have cut the message short
        return payload
    found = fields[field]
    if isinstance(found, bytes):
        fields[field] = _FLOAT32.pack(value) * (len(found) // _FLOAT32.size)
    else:
        fields[field] = _with_floats(found, value)
    return codec.encode(fields)


def _with_reading(payload: bytes, reading: struct.Struct, behind: int, value: float) -> bytes:
    """Return `payload` with `value` for each float of its reading; `behind` bytes follow the reading."""
    end = len(payload) - behind
    start = end - reading.size
    codes = reading.format.lstrip("<")
    numbers = zip(codes, reading.unpack(payload[start:end]), strict=True)
    wrong = (value if code in _FRACTIONS else it for code, it in numbers)
    return payload[:start] + reading.pack(*wrong) + payload[end:]


def damaged_answer(response: Codec, data: bytes, damages: Sequence[Damage]) -> bytes:
    """Return the response of a service, changed by all `damages`; `data` is a status byte and a frame.

    The response of a failed call is not changed.
    """
    succeeded, payload = data[:1], data[1 + LENGTH.size :]
    if succeeded != b"\1":
        return data
    for damage in damages:
        if not isinstance(damage, WrongValue):
            payload = payload[: len(payload) // 2]
            continue
        with suppress(ValueError):  # an earlier corruption may have cut the message short
            payload = response.encode(_with_floats(response.decode(payload), damage.value)._asdict())
    return succeeded + frame(payload)


def _with_floats(part: Any, value: float) -> Any:
    """Return a decoded message, or a part of a message, with `value` in place of each float."""
    if isinstance(part, float):
        return value
    if isinstance(part, list | tuple):
        changed = [_with_floats(it, value) for it in part]
        make = getattr(part, "_make", None)  # a nested message is a named tuple
        return changed if make is None else make(changed)
    return part
