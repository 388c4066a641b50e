"""The connection headers that a publisher and a subscriber of a topic exchange.

The subscriber connects and sends its header. The publisher compares the md5 sums, and responds with its own
header or with an error. Source: http://wiki.ros.org/ROS/Connection%20Header
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from palaestra_protocol.ros.rostypes import MessageType

ANY: Final = "*"  # tools such as `rostopic echo` accept every md5 sum and every type


class HeaderRefused(Exception):
    """The header of a peer does not fit; a server sends the text of the error to the peer."""


def subscriber_header(caller: str, topic: str, type_: MessageType) -> dict[str, str]:
    """Return the header that the node `caller` sends to a publisher of `topic`."""
    return {
        "callerid": caller,
        "md5sum": type_.md5,
        "message_definition": type_.definition,
        "tcp_nodelay": "1",
        "topic": topic,
        "type": type_.name,
    }


def publisher_header(
    caller: str, topic: str, type_: MessageType, theirs: Mapping[str, str], *, latched: bool = False
) -> dict[str, str]:
    """Return the header with which the node `caller` responds to a subscriber of `topic`.

    Args:
        caller: the full name of the publishing node.
        topic: the full name of the topic.
        type_: the type of the topic's messages.
        theirs: the header of the subscriber.
        latched: whether a late subscriber gets the last message.

    Raises:
        HeaderRefused: the subscriber wants another type.
    """
    agreed_md5(theirs, type_.name, type_.md5)
    return {
        "callerid": caller,
        "latching": str(int(latched)),
        "md5sum": type_.md5,
        "message_definition": type_.definition,
        "topic": topic,
        "type": type_.name,
    }


def check_publisher(theirs: Mapping[str, str], type_: MessageType) -> None:
    """Check the header with which a publisher responds.

    Raises:
        HeaderRefused: the publisher refuses the connection, or publishes another type.
    """
    if "error" in theirs:
        raise HeaderRefused(f"the publisher refused the connection: {theirs['error']}")
    if theirs.get("md5sum") not in {ANY, type_.md5}:
        raise HeaderRefused(f"the publisher sends md5sum {theirs.get('md5sum')}, not that of {type_.name}")


def agreed_md5(theirs: Mapping[str, str], type_name: str, *known: str) -> str:
    """Return the md5 sum in the header of a client, or the first known sum if the client accepts any sum.

    Raises:
        HeaderRefused: the client's md5 sum is not one of `known`.
    """
    wanted = theirs.get("md5sum", ANY)
    if wanted not in {ANY, *known}:
        raise HeaderRefused(f"the client wants md5sum {wanted}, but {type_name} has {known[0]}")
    return known[0] if wanted == ANY else wanted
