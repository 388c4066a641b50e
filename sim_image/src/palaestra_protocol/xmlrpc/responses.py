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
