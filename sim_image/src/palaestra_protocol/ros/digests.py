"""The md5 sum of a type, and the full text of a message.

Two peers compare the md5 sums of a type when they connect. A publisher also sends the full text, which ROS
tools use to decode messages. The sum covers constants, fields and the sums of nested messages, but not
comments or package names.
Source: http://wiki.ros.org/ROS/Technical%20Overview#Message_serialization_and_msg_MD5_sums
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator

from palaestra_protocol.ros.syntax import BUILT_IN, Message, MessageField

_LINE = "=" * 80


def md5(find: Callable[[str], Message], *messages: Message) -> str:
    """Return the md5 sum of a message or of a service.

    Args:
        find: returns the definition of a nested message by its name.
        messages: the message, or the request and the response of the service.
    """
    covered = "".join("\n".join(_covered(find, message)) for message in messages)
    return hashlib.md5(covered.encode(), usedforsecurity=False).hexdigest()


def full_text(find: Callable[[str], Message], message: Message) -> str:
    """Return the text of a message, followed by the text of each nested message.

    Args:
        find: returns the definition of a nested message by its name.
        message: the definition of the outer message.
    """
    inside = (f"{_LINE}\nMSG: {name}\n{find(name).text}" for name in dict.fromkeys(_nested(find, message)))
    return "\n".join((message.text, *inside))


def _covered(find: Callable[[str], Message], message: Message) -> Iterator[str]:
    """Yield the lines that the sum covers."""
    yield from message.constants
    for field in message.fields:
        yield f"{_covered_type(find, field)} {field.name}"


def _covered_type(find: Callable[[str], Message], field: MessageField) -> str:
    return f"{field.type}{field.array}" if field.type in BUILT_IN else md5(find, find(field.type))


def _nested(find: Callable[[str], Message], message: Message) -> Iterator[str]:
    """Yield the name of each nested message, at any depth, once for each occurrence."""
    for field in message.fields:
        if field.type not in BUILT_IN:
            yield field.type
            yield from _nested(find, find(field.type))
