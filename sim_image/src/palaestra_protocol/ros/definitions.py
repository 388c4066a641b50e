"""The definitions of ROS types, as text and parsed, so that no ROS package has to be installed.

The file `definitions.txt` holds the types of the interface, with their nested messages. The file
`common_types.txt` holds the other types of ROS's common packages. It is read only when a program uses such a
type.
"""

from __future__ import annotations

from functools import cache
from importlib import resources

from palaestra_protocol.ros.syntax import Message, parse

_INTERFACE, _COMMON = "definitions.txt", "common_types.txt"
_PARTING = "---"  # the separator between the request and the response of a service


def type_names() -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names of the interface's messages and of its services, each as `package/Name`."""
    return _names(_INTERFACE)


def common_type_names() -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names of the other messages and services of ROS's common packages."""
    return _names(_COMMON)


def _names(file: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    table = _table(file)
    services = tuple(name for name, fields in table.items() if _PARTING in fields)
    return tuple(name for name in table if name not in services), services


def text(name: str) -> str:
    """Return the text of the type's `.msg` or `.srv` file, one field per line.

    Raises:
        KeyError: neither file has such a type.
    """
    return f"{_PARTING}\n".join(_parts(name))


@cache
def message(name: str) -> Message:
    """Return the definition of a message.

    Raises:
        KeyError: neither file has such a message.
    """
    return parse(name, text(name))


def service(name: str) -> tuple[Message, Message]:
    """Return the definitions of a service's request and response.

    Raises:
        KeyError: neither file has such a service.
    """
    request, response = _parts(name)
    return parse(f"{name}Request", request), parse(f"{name}Response", response)


def _parts(name: str) -> list[str]:
    interface = _table(_INTERFACE)
    fields = interface[name] if name in interface else _table(_COMMON)[name]
    return [_lines(part) for part in fields.split(_PARTING)]


@cache
def _table(file: str) -> dict[str, str]:
    table = resources.files("palaestra_protocol.ros").joinpath(file).read_text("utf-8")
    lines = (line for line in table.splitlines() if line and not line.startswith("#"))
    return {name: fields for name, _, fields in (line.partition(":") for line in lines)}


def _lines(fields: str) -> str:
    return "".join(f"{field.strip()}\n" for field in fields.split(";"))
