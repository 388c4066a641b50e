"""The value that every call to a ROS master or node returns: a code, a text for people, and the result."""

from typing import Any, NamedTuple

OK = 1
FAILED = 0
WRONG = -1  # the caller made a mistake


class RpcResponse(NamedTuple):
    """The response to a ROS call: `OK`, `FAILED` or `WRONG`, a text for people, and the result."""

    code: int
    text: str
    value: Any


def response_of(value: Any) -> RpcResponse | None:
    """Return the value of a ROS call as a response; None if it is not a code, a text and a result."""
    match value:
        case [int(code), str(text), result]:
            return RpcResponse(code, text, result)
    return None


def address_of(response: RpcResponse) -> tuple[str, int] | None:
    """Return the host and port in the response to `requestTopic`; None if it has no TCPROS address."""
    match response.value:
        case [str(), str(host), int(port)] if response.code == OK:
            return host, port
    return None
