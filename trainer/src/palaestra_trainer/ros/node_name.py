"""Compute the name of a ROS node from the program's arguments that rename it, as rospy does.

`__name:=NAME` and `__ns:=NAMESPACE` rename the node. The other forms, `TOPIC:=OTHER` and `_PARAMETER:=VALUE`,
have no effect, because the topics and services of simulators have full names, and the trainer does not read
parameters.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from palaestra_trainer.errors import ConfigurationError

_NAME, _NAMESPACE = "__name:=", "__ns:="
_LEGAL = re.compile(r"/|/?[A-Za-z][A-Za-z0-9_/]*")


def full_name(name: str, arguments: Sequence[str], environment: Mapping[str, str]) -> str:
    """Return the full name of the node that a program calls `name`.

    Args:
        name: the name that the program chooses.
        arguments: the arguments of the program; the last name and the first namespace among them count.
        environment: the environment variables; ROS_NAMESPACE counts if no argument sets a namespace.

    Raises:
        ConfigurationError: an argument sets a name that is invalid for a node.
    """
    chosen = _values(arguments, _NAME)
    namespaces = [*_values(arguments, _NAMESPACE), environment.get("ROS_NAMESPACE", "")]
    if chosen:
        name = chosen[-1]
    namespace = namespaces[0].strip("/")
    return name if name.startswith("/") else f"/{namespace}/{name}" if namespace else f"/{name}"


def _values(arguments: Sequence[str], option: str) -> list[str]:
    """Return the values of an option among the arguments.

    Raises:
        ConfigurationError: a value is not a valid name.
    """
    values = [word.removeprefix(option) for word in arguments if word.startswith(option)]
    for value in values:
        if not _LEGAL.fullmatch(value):
            fact = f"{option}{value}: is not a valid ROS name"
            raise ConfigurationError(f"{fact}; begin with a letter, and use letters, digits, _ and / only")
    return values
