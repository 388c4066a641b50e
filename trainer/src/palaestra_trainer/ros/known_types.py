"""The names and types that services and subscribers accept, with an error for all others."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, TypeVar

from palaestra_trainer.errors import ConfigurationError

Type = TypeVar("Type")

_PACKAGES: Final = (
    "webots_ros, std_msgs, geometry_msgs, sensor_msgs, nav_msgs, actionlib_msgs, rosgraph_msgs or std_srvs"
)


def node_of(name: str) -> str:
    """Return the first part of a full name, which is the node of a simulator's services and topics.

    Raises:
        ConfigurationError: the name is not a full name.
    """
    if not name.startswith("/") or name == "/":
        raise ConfigurationError(f'"{name}": is not the full name of a service or topic; begin it with "/"')
    return name.split("/")[1]


def known_type(find: Callable[[str], Type], name: str) -> Type:
    """Return the type with this name, `package/Name`, from `find`.

    Raises:
        ConfigurationError: the type is not known.
    """
    try:
        return find(name)
    except (KeyError, ValueError):  # ValueError: a message type where a service type is needed, or vice versa
        raise ConfigurationError(
            f"{name}: is not a known type of this kind; use a type of {_PACKAGES}, or a client of rospy"
        ) from None
