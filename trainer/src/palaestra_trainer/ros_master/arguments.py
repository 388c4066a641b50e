"""Check the arguments of calls to the master."""

from __future__ import annotations

from typing import Any

from palaestra_trainer.ros_master.names import SEPARATOR, resolved
from palaestra_trainer.ros_master.registrations import ANY_TYPE

_SCHEMES = ("http://", "rosrpc://")
_ILLEGAL = (":", " ")


class WrongArgument(ValueError):
    """An argument of a call is wrong; the message names the argument."""


def text_of(argument: str, value: Any) -> str:
    """Check that an argument is a text and not empty; return the text.

    Raises:
        WrongArgument: the argument is empty or not a text.
    """
    if not isinstance(value, str) or not value:
        raise WrongArgument(f"{argument}: {value!r} is empty or not a text; give a name")
    return value


def name_of(argument: str, value: Any, caller: str) -> str:
    """Check that an argument is a name; return the global name that the caller means.

    Raises:
        WrongArgument: the argument is not a name.
    """
    name = text_of(argument, value)
    if any(character in name for character in _ILLEGAL):
        raise WrongArgument(f"{argument}: {name!r} is not a name; a name has no colon and no blank")
    return resolved(name, caller)


def topic_or_service(argument: str, value: Any, caller: str) -> str:
    """Check that an argument names a topic or service; return the global name.

    Raises:
        WrongArgument: the argument is not a name, or is the root.
    """
    name = name_of(argument, value, caller)
    if name == SEPARATOR:
        raise WrongArgument(f"{argument}: {value!r} is the root of all names; give a name below it")
    return name


def uri_of(argument: str, value: Any) -> str:
    """Check that an argument is the URI of a node or service; return it.

    Raises:
        WrongArgument: the argument is not such a URI.
    """
    uri = text_of(argument, value)
    if not uri.startswith(_SCHEMES):
        raise WrongArgument(f"{argument}: {uri!r} is not a URI; it must begin with {' or '.join(_SCHEMES)}")
    return uri


def type_name_of(argument: str, value: Any) -> str:
    """Check that an argument is the type of a topic, `package/Name` or ANY_TYPE; return it.

    Raises:
        WrongArgument: the argument is neither a type nor ANY_TYPE.
    """
    name = text_of(argument, value)
    if name != ANY_TYPE and name.count(SEPARATOR) != 1:
        raise WrongArgument(f"{argument}: {name!r} is not a type such as std_msgs/String")
    return name
