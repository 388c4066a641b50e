"""The interface of the ROS node that a controller needs, and the form in which modules declare services.

The package `ros` implements the interface with sockets. This module uses no socket.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from typing import Any, Final, NamedTuple, Protocol

from palaestra_sim.errors import SimError

Fields = Mapping[str, Any]
Handler = Callable[[Any], Any]
Row = tuple[str, str, Handler]  # a declared service: last part of the path, type without package, handler

FORCE_FEEDBACK: Final = {
    "set_constant_force": "set_int",
    "set_constant_force_duration": "set_float",
    "set_auto_centering_gain": "set_float",
    "set_resistance_gain": "set_float",
    "set_force_axis": "set_int",
}
"""The services of a joystick for force feedback, with their types."""


class UnsimulatedError(SimError, NotImplementedError):
    """Webots supports the request, but this simulator does not."""


class Service(NamedTuple):
    """One service: its path relative to the node's name, its type, and its handler."""

    path: str
    type_name: str
    handler: Handler


class PublisherInterface(Protocol):
    """Sends messages of one topic to the subscribers that are connected at that moment."""

    @property
    def heard(self) -> bool:
        """Whether the topic has a subscriber."""
        ...

    def send(self, fields: Fields) -> None:
        """Send a message with these fields."""
        ...

    def send_value(self, value: Any) -> None:
        """Send the template with `value` in its last field; the wall clock is the time stamp.

        If the last field has several numbers, `value` is a tuple of them.
        """
        ...

    def send_stamped(self, fields: Fields) -> None:
        """Send the template with `fields` in place of its own fields; the wall clock is the time stamp."""
        ...


class NodeInterface(Protocol):
    """A ROS node; paths are relative to its name.

    Attributes:
        name: the name of the node.
        blocked: returns whether requests have to wait; called before each request.
        current_call: the request in progress; a handler that returns LATER passes it to `answer`.
    """

    name: str
    blocked: Callable[[], bool]
    current_call: object | None

    def serve(self, path: str, type_name: str, handler: Handler) -> None:
        """Serve a service; `handler` returns the response to a request, or LATER to call `answer` later."""
        ...

    def together(self) -> AbstractContextManager[None]:
        """Register all services and topics of a `with` block at its end, in their order."""
        ...

    def advertise(
        self,
        path: str,
        type_name: str,
        *,
        latched: bool = False,
        template: Fields | None = None,
        reading: str = "",
    ) -> PublisherInterface:
        """Return a publisher of a topic.

        Args:
            path: relative to the node's name, or global with a leading slash.
            type_name: the message type.
            latched: whether a late subscriber gets the last message.
            template: the constant fields of the messages.
            reading: the name of the field with the value; "" means the last field.
        """
        ...

    def withdraw(self, publisher: Any) -> None:
        """Remove a publisher; a topic without publishers ends."""
        ...

    def answer(self, call: Any, fields: Fields) -> None:
        """Send the response to a call whose handler returned LATER."""
        ...

    def later(self, delay_s: float, callback: Callable[[], None]) -> None:
        """Call `callback` after a delay; 0 means right after the response to the current call."""
        ...

    def close(self) -> None:
        """Unregister all services and topics, and close all sockets."""
        ...


def topic_name(name: str) -> str:
    """Return a device's name as the controller writes it in paths: `-`, `.`, space, `(`, `)` become `_`."""
    return name.translate(_REPLACED)


def as_ros_name(name: str) -> str:
    """Return `name` with an underscore in place of each character that `is_ros_name` refuses."""
    return "/".join(_ILLEGAL.sub("_", part) for part in name.split("/") if part) or "_"


def is_ros_name(name: str) -> bool:
    """Return whether ROS accepts `topic_name(name)` as a part of a path.

    Webots' controller exits if a device has a name that ROS refuses.
    """
    return _LEGAL.fullmatch(topic_name(name)) is not None


_REPLACED = str.maketrans("-. ()", "_____")
_LEGAL = re.compile(r"[A-Za-z0-9_]+(/[A-Za-z0-9_]+)*")
_ILLEGAL = re.compile(r"[^-. ()A-Za-z0-9_]")
