"""Messages and answers made wrong, as the bytes that travel.

Pure. A message keeps its length prefix right: what is wrong is inside, so that the stream stays in step.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any

from palaestra_protocol.ros.rostypes import Codec
from palaestra_protocol.ros.tcpros import LENGTH, frame
from palaestra_sim.stub.faults.course import Damage
from palaestra_sim.stub.faults.kinds import WrongValue

# Of the topics that sensors publish, those with a fraction in their last field; a bumper has none.
_TRAILING_FLOATS = {
    "sensor_msgs/Range": struct.Struct("<f"),
    "webots_ros/Float64Stamped": struct.Struct("<d"),
}


def damaged_message(type_name: str, data: bytes, damages: Sequence[Damage]) -> bytes:
    """Return a framed message of a topic with everything of `damages` wrong about it."""
    payload = data[LENGTH.size :]
    for damage in damages:
        if not isinstance(damage, WrongValue):
            payload = payload[: len(payload) // 2]
        elif type_name in _TRAILING_FLOATS:
            trailing = _TRAILING_FLOATS[type_name]
            payload = payload[: -trailing.size] + trailing.pack(damage.value)
    return frame(payload)


def damaged_answer(response: Codec, data: bytes, damages: Sequence[Damage]) -> bytes:
    """Return a service's answer, its first byte and its frame, with everything of `damages` wrong about it.

    One that says that the service failed stays as it is.
    """
    succeeded, payload = data[:1], data[1 + LENGTH.size :]
    if succeeded != b"\1":
        return data
    for damage in damages:
        if isinstance(damage, WrongValue):
            payload = response.encode(_fields(response.decode(payload), damage.value))
        else:
            payload = payload[: len(payload) // 2]
    return succeeded + frame(payload)


def _fields(message: Any, value: float) -> dict[str, Any]:
    """Return the fields of a decoded message, with `value` in place of each float."""
    names = getattr(message, "_fields", None) or message.__slots__
    return {name: _with_floats(getattr(message, name), value) for name in names}


def _with_floats(part: Any, value: float) -> Any:
    """Return a part of a decoded message as it can be encoded, with `value` in place of each float."""
    if isinstance(part, float):
        return value
    if hasattr(part, "_fields"):
        return _fields(part, value)
    if isinstance(part, list | tuple):
        return [_with_floats(it, value) for it in part]
    if hasattr(part, "__slots__"):
        for name, field in _fields(part, value).items():
            setattr(part, name, field)
    return part
