"""The definitions of the ROS types: the text of each `.msg` and `.srv` file, and genmsg's specs of them.

They are in `definitions.txt`, also those of nested messages, so no ROS package has to be installed.
"""

from __future__ import annotations

from functools import cache
from importlib import resources
from typing import Any

import genmsg
import genmsg.msg_loader

_PARTING = "---"  # between request and response


def type_names() -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names of all messages and of all services, each as `package/Name`."""
    table = _table()
    services = tuple(name for name, fields in table.items() if _PARTING in fields)
    return tuple(name for name in table if name not in services), services


def is_defined(name: str) -> bool:
    """Return whether `package/Name` has a definition; built-in types such as `int32` have none."""
    return name in _table()


def text(name: str) -> str:
    """Return the text of the type's `.msg` or `.srv` file, a field a line.

    Raises:
        KeyError: `definitions.txt` has no such type.
    """
    parts = (_lines(part) for part in _table()[name].split(_PARTING))
    return f"{_PARTING}\n".join(parts)


def message_spec(name: str) -> Any:
    """Return genmsg's `MsgSpec` of a message.

    Raises:
        KeyError: `definitions.txt` has no such message.
    """
    return genmsg.msg_loader.load_msg_from_string(genmsg.MsgContext.create_default(), text(name), name)


def service_spec(name: str) -> Any:
    """Return genmsg's `SrvSpec` of a service.

    Raises:
        KeyError: `definitions.txt` has no such service.
    """
    return genmsg.msg_loader.load_srv_from_string(genmsg.MsgContext.create_default(), text(name), name)


def context_for(*specs: Any) -> Any:
    """Return genmsg's `MsgContext` with these messages and all messages inside them."""
    context = genmsg.MsgContext.create_default()
    for spec in specs:
        for name in all_nested(spec):
            context.register(name, message_spec(name))
    for spec in specs:
        context.register(spec.full_name, spec)
        genmsg.msg_loader.load_depends(context, spec, {})
    return context


def all_nested(spec: Any) -> set[str]:
    """Return the names of all messages inside a message, at any depth."""
    found: set[str] = set()
    waiting = _nested(spec)
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += _nested(message_spec(name))
    return found


def _nested(spec: Any) -> list[str]:
    bare = (genmsg.msgs.bare_msg_type(type_) for type_ in spec.types)
    return [
        "std_msgs/Header" if type_ == "Header" else type_
        for type_ in bare
        if not genmsg.msgs.is_builtin(type_)
    ]


@cache
def _table() -> dict[str, str]:
    table = resources.files("palaestra_protocol.ros").joinpath("definitions.txt").read_text("utf-8")
    lines = (line for line in table.splitlines() if line and not line.startswith("#"))
    return {name: fields for name, _, fields in (line.partition(":") for line in lines)}


def _lines(fields: str) -> str:
    return "".join(f"{field.strip()}\n" for field in fields.split(";"))
