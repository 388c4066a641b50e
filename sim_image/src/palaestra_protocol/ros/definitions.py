"""The definitions of the ROS types of the interface, as text and parsed.

The file `definitions.txt` holds all these definitions, including those of nested messages. So no ROS package
has to be installed.
"""

from __future__ import annotations

from functools import cache
from importlib import resources

from palaestra_protocol.ros.syntax import Message, parse

_PARTING = "---"  # the separator between the request and the response of a service


def type_names() -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names of all messages and of all services, each as `package/Name`."""
    table = _table()
    services = tuple(name for name, fields in table.items() if _PARTING in fields)
    return tuple(name for name in table if name not in services), services


def text(name: str) -> str:
    """Return the text of the type's `.msg` or `.srv` file, one field per line.

    Raises:
        KeyError: `definitions.txt` has no such type.
    """
    return f"{_PARTING}\n".join(_parts(name))


@cache
def message(name: str) -> Message:
    """Return the definition of a message.

    Raises:
        KeyError: `definitions.txt` has no such message.
    """
    return parse(name, text(name))


def service(name: str) -> tuple[Message, Message]:
    """Return the definitions of a service's request and response.

    Raises:
        KeyError: `definitions.txt` has no such service.
    """
    request, response = _parts(name)
    return parse(f"{name}Request", request), parse(f"{name}Response", response)


def _parts(name: str) -> list[str]:
    return [_lines(part) for part in _table()[name].split(_PARTING)]


@cache
def _table() -> dict[str, str]:
    table = resources.files("palaestra_protocol.ros").joinpath("definitions.txt").read_text("utf-8")
    lines = (line for line in table.splitlines() if line and not line.startswith("#"))
    return {name: fields for name, _, fields in (line.partition(":") for line in lines)}


def _lines(fields: str) -> str:
    return "".join(f"{field.strip()}\n" for field in fields.split(";"))
