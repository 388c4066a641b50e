"""The response of every ROS call, of the master and of nodes: a code, a text for people, and a value."""

from typing import Any, NamedTuple

OK = 1
FAILED = 0
WRONG = -1  # the caller's mistake


class RpcResponse(NamedTuple):
    """The response to a ROS call."""

    code: int
    text: str
    value: Any
