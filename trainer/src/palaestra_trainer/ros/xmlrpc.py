"""One XML-RPC call to the ROS master or to a node, with a deadline and a checked response.

rosgraph's own client would wait forever. The peer may send any bytes. If they are not a response, Python's
parser raises errors of many types, and this module converts all of them to `UnreadableAnswer`.
"""

from __future__ import annotations

import http.client
import xmlrpc.client
from typing import Any, NamedTuple

from palaestra_trainer.errors import UnreadableAnswer

OK = 1


class RpcResponse(NamedTuple):
    """The response to a ROS call: 1 for success, a text for people, a value."""

    code: int
    text: str
    value: Any


class _Deadline(xmlrpc.client.Transport):
    """An HTTP transport for one call whose reads and writes end after `timeout_s` seconds."""

    def __init__(self, timeout_s: float) -> None:
        super().__init__()
        self._timeout_s = timeout_s

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        """Return a connection whose reads and writes end in time."""
        connection = http.client.HTTPConnection(host, timeout=self._timeout_s)
        self._connection = host, connection  # the base class closes the connection in this attribute
        return connection


def call(uri: str, timeout_s: float, method: str, *arguments: Any) -> RpcResponse:
    """Return the response of the server at `uri`.

    Raises:
        OSError: the server cannot be reached; a TimeoutError if it does not respond in time.
        UnreadableAnswer: it sent an invalid ROS response.
    """
    try:
        with xmlrpc.client.ServerProxy(uri, transport=_Deadline(timeout_s)) as proxy:
            answer: Any = getattr(proxy, method)(*arguments)
    except OSError:
        raise
    except Exception as error:  # of many types: ExpatError, ValueError, TypeError, IndexError, ...
        raise UnreadableAnswer(f"{uri} answered {method} with invalid XML-RPC: {error!r}") from error
    match answer:
        case [int(code), str(text), value]:
            return RpcResponse(code, text, value)
    raise UnreadableAnswer(f"{uri} answered {method} with {answer!r}, not with a code, a text and a value")
