"""Make an XML-RPC call to the ROS master or a node, with a deadline and a check of the response.

The client of rosgraph would wait forever. The peer may send any bytes, and an invalid response raises
`UnreadableAnswer`.
"""

from __future__ import annotations

import xmlrpc.client
from typing import Any

from palaestra_protocol.xmlrpc import client
from palaestra_protocol.xmlrpc.documents import UnreadableDocument
from palaestra_protocol.xmlrpc.responses import RpcResponse, response_of
from palaestra_trainer.errors import UnreadableAnswer


def call(uri: str, timeout_s: float, method: str, *arguments: Any) -> RpcResponse:
    """Call a method of the server at `uri` and return the response.

    Raises:
        OSError: the server cannot be reached; TimeoutError, a subclass, if it does not respond in time.
        UnreadableAnswer: the server sent an invalid ROS response.
    """
    try:
        answer: Any = client.call(uri, timeout_s, method, *arguments)
    except (UnreadableDocument, xmlrpc.client.Fault) as error:
        raise UnreadableAnswer(f"{uri} responded to {method} with invalid XML-RPC: {error}") from error
    if (response := response_of(answer)) is not None:
        return response
    raise UnreadableAnswer(
        f"{uri} responded to {method} with {answer!r} instead of a code, a text and a value"
    )
