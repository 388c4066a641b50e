"""The ROS node that a controller needs, as a Protocol, and services before they have a node.

The wire is in `ros`; nothing here needs a socket.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from typing import Any, NamedTuple, Protocol

from palaestra_sim.errors import SimError

Fields = Mapping[str, Any]
Handler = Callable[[Any], Any]
Row = tuple[str, str, Handler]  # of a table of services: last part of the path, type without package, handler


class UnsimulatedError(SimError, NotImplementedError):
    """Webots does what the request asks for, and this simulator does not."""


class Service(NamedTuple):
    """One service: its path below the node's name, its type, and the function that answers."""

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

        A field of several numbers takes a tuple of them.
        """
        ...

    def send_stamped(self, fields: Fields) -> None:
        """Send a message stamped with the wall clock, of these fields over the template's."""
        ...


class NodeInterface(Protocol):
    """A ROS node; paths are relative to its name.

    Attributes:
        name: of the node.
        blocked: returns whether requests have to wait; called before each.
        current_call: identifies the request that is being handled, for `answer`.
    """

    name: str
    blocked: Callable[[], bool]
    current_call: object | None

    def serve(self, path: str, type_name: str, handler: Handler) -> None:
        """Answer a service with what `handler` returns for a request, or later if that is LATER."""
        ...

    def together(self) -> AbstractContextManager[None]:
        """Make the services and topics of a block known at its end, all at once and in their order."""
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
        """Return a publisher of a topic, relative or with a leading slash; `reading` has the value."""
        ...

    def withdraw(self, publisher: Any) -> None:
        """Take a publisher back."""
        ...

    def answer(self, call: Any, fields: Fields) -> None:
        """Answer a call whose handler returned LATER."""
        ...

    def later(self, delay_s: float, callback: Callable[[], None]) -> None:
        """Call back after a delay; 0 is after the answer of the present call was sent."""
        ...

    def close(self) -> None:
        """Unregister and close everything."""
        ...


def topic_name(name: str) -> str:
    """Return a name in the form that the controller uses in paths: five characters become underscores."""
    return name.translate(_REPLACED)


def as_ros_name(name: str) -> str:
    """Return a name with an underscore in the place of each character that `is_ros_name` refuses."""
    return "/".join(_ILLEGAL.sub("_", part) for part in name.split("/") if part) or "_"


def is_ros_name(name: str) -> bool:
    """Return whether ROS takes a name as a part of paths, in the form that the controller gives it.

    The controller ends at a name that ROS refuses.
    """
    return _LEGAL.fullmatch(topic_name(name)) is not None


_REPLACED = str.maketrans("-. ()", "_____")
_LEGAL = re.compile(r"[A-Za-z0-9_]+(/[A-Za-z0-9_]+)*")
_ILLEGAL = re.compile(r"[^-. ()A-Za-z0-9_]")
