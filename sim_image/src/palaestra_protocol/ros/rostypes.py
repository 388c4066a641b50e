"""The ROS types of the interface; each has its codecs, and the md5 sum that peers compare."""

from __future__ import annotations

import struct
from dataclasses import replace
from functools import cache
from typing import Final, NamedTuple

from palaestra_protocol.ros import definitions, digests
from palaestra_protocol.ros.codec import Codec, codec_of
from palaestra_protocol.ros.fixed import TIMES, has_fixed_size, record

__all__ = [
    "Codec",
    "MessageType",
    "ServiceType",
    "last_field",
    "message_type",
    "reading_field",
    "service_type",
]


class MessageType(NamedTuple):
    """One topic type: its name, the md5 sum that peers compare, its definition, and its codec."""

    name: str
    md5: str
    definition: str
    codec: Codec


class ServiceType(NamedTuple):
    """One service type: its name, the md5 sums that peers compare, and the two codecs.

    Attributes:
        name: `package/name`.
        md5: the md5 sum in Webots R2023b.
        request: the codec of a call's request.
        response: the codec of a call's response.
        later_md5: the md5 sum in Webots R2025a. The two sums differ if R2025a renamed a field. Both releases
            send the same bytes.
    """

    name: str
    md5: str
    request: Codec
    response: Codec
    later_md5: str


# Webots R2025a renamed this field of requests from `proto` to `queryBaseNode`. Source: the change log of
# Webots, ROS 1 API.
_FORMER: Final = ("bool", "proto")
_LATER: Final = "queryBaseNode"


@cache
def message_type(name: str) -> MessageType:
    """Return the message type `package/Name`.

    Raises:
        KeyError: no such message is known.
    """
    find = definitions.message
    message = find(name)
    codec = codec_of(message, find)
    return MessageType(name, digests.md5(find, message), digests.full_text(find, message), codec)


@cache
def service_type(name: str) -> ServiceType:
    """Return the service type `package/name`.

    Raises:
        KeyError: no such service is known.
    """
    find = definitions.message
    request, response = definitions.service(name)
    fields = tuple(
        replace(each, name=_LATER) if (each.type, each.name) == _FORMER else each for each in request.fields
    )
    return ServiceType(
        name,
        digests.md5(find, request, response),
        codec_of(request, find),
        codec_of(response, find),
        digests.md5(find, replace(request, fields=fields), response),
    )


@cache
def last_field(name: str) -> struct.Struct | None:
    """Return the layout of the last field of the message type `package/Name`.

    Return None if the field is a time, an array, or of variable size.

    Raises:
        KeyError: no such message is known.
    """
    message = definitions.message(name)
    last = message.fields[-1]
    if last.array or last.type in TIMES or not has_fixed_size(last, definitions.message):
        return None
    return struct.Struct(f"<{record(message, [last], definitions.message).codes}")


@cache
def reading_field(name: str, field: str) -> tuple[struct.Struct, int] | None:
    """Return the layout of a field of the message type `package/Name`, and the number of bytes after it.

    Return None if the field is neither a number nor a message of numbers, or if a later field has variable
    size.

    Args:
        name: the name of the message type.
        field: the name of the field; "" means the last field.

    Raises:
        KeyError: no such message is known, or the message has no such field.
    """
    if not field:
        last = last_field(name)
        return None if last is None else (last, 0)
    message = definitions.message(name)
    names = [it.name for it in message.fields]
    if field not in names:
        raise KeyError(f"{name}.{field}")
    found, *behind = message.fields[names.index(field) :]
    if found.array or found.type in TIMES:
        return None
    if not all(has_fixed_size(it, definitions.message) for it in (found, *behind)):
        return None
    codes = record(message, [found], definitions.message).codes
    after = record(message, behind, definitions.message).codes
    return struct.Struct(f"<{codes}"), struct.calcsize(f"<{after}")
