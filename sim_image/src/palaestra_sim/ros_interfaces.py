"""The ROS node that a controller needs, as a Protocol, and services that do not yet belong to a node.

The wire protocol is in `ros`; nothing here needs a socket.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from typing import Any, NamedTuple, Protocol

from palaestra_sim.errors import SimError

Fields = Mapping[str, Any]
Handler = Callable[[Any], Any]
Row = tuple[str, str, Handler]  # a row of the services: last part of the path, type without package, handler


class UnsimulatedError(SimError, NotImplementedError):
    """Webots supports the request, but this simulator does not."""


class Service(NamedTuple):
    """One service: its path relative to the node's name, its type, and its handler."""

    path: str
    type_name: str
    handler: Handler


class PublisherInterface(Protocol):
    """Sends to the subscribers that are connected at that moment."""

    @property
    def heard(self) -> bool:
        """Whether there is a subscriber."""
        ...

    def send(self, fields: Fields) -> None:
        """Send a message of these fields."""
        ...

    def send_value(self, value: Any) -> None:
        """Send a message stamped with the wall clock: the template, and `value` in its last field.

        If the field has several numbers, `value` is a tuple of them.
        """
        ...

    def send_stamped(self, fields: Fields) -> None:
        """Send a message stamped with the wall clock, of these fields over the template's."""
        ...


class NodeInterface(Protocol):
    """A ROS node; paths are relative to its name.

    Attributes:
        name: the name of the node.
        blocked: returns whether requests have to wait; called before each request.
        current_call: identifies the request in progress, for `answer`.
    """

    name: str
    blocked: Callable[[], bool]
    current_call: object | None

    def serve(self, path: str, type_name: str, handler: Handler) -> None:
        """Serve a service; `handler` returns the response to a request, or LATER to send it later."""
        ...

    def together(self) -> AbstractContextManager[None]:
        """Register the services and topics of a block together at its end, in their order."""
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
        """Return a publisher of a topic, relative or with a leading slash; `reading` is the value's field."""
        ...

    def withdraw(self, publisher: Any) -> None:
        """Withdraw a publisher: its topic ends."""
        ...

    def answer(self, call: Any, fields: Fields) -> None:
        """Send the response to a call whose handler returned LATER."""
        ...

    def later(self, delay_s: float, callback: Callable[[], None]) -> None:
        """Call back after a delay; 0 means after the response of the current call was sent."""
        ...

    def close(self) -> None:
        """Unregister and close everything."""
        ...


def topic_name(name: str) -> str:
    """Return a name in the form that the controller uses in paths: five characters become underscores."""
    return name.translate(_REPLACED)


def as_ros_name(name: str) -> str:
    """Return a name in which each character that `is_ros_name` refuses is an underscore."""
    return "/".join(_ILLEGAL.sub("_", part) for part in name.split("/") if part) or "_"


def is_ros_name(name: str) -> bool:
    """Return whether ROS accepts a name as a part of paths, in the form that the controller gives it.

    Webots' controller exits at a name that ROS refuses.
    """
    return _LEGAL.fullmatch(topic_name(name)) is not None


_REPLACED = str.maketrans("-. ()", "_____")
_LEGAL = re.compile(r"[A-Za-z0-9_]+(/[A-Za-z0-9_]+)*")
_ILLEGAL = re.compile(r"[^-. ()A-Za-z0-9_]")
