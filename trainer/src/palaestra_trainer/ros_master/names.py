"""Resolve names of ROS 1: `/a/b` is global, `~b` is private to a node, `b` is relative to its namespace.

Source: http://wiki.ros.org/Names
"""

from __future__ import annotations

SEPARATOR = "/"
_PRIVATE = "~"


def parts(name: str) -> tuple[str, ...]:
    """Return the parts of a name between its slashes; an empty tuple for `/`."""
    return tuple(part for part in name.split(SEPARATOR) if part)


def is_global(name: str) -> bool:
    """Return whether a name begins at the root."""
    return name.startswith(SEPARATOR)


def is_private(name: str) -> bool:
    """Return whether a name is private, which means below the name of its node."""
    return name.startswith(_PRIVATE)


def joined(names: tuple[str, ...]) -> str:
    """Return the global name that consists of these parts."""
    return SEPARATOR + SEPARATOR.join(names)


def below(namespace: str, name: str) -> str:
    """Return a relative name inside a namespace; return a global or private name unchanged."""
    if is_global(name) or is_private(name):
        return name
    return f"{namespace.removesuffix(SEPARATOR)}{SEPARATOR}{name}"


def resolved(name: str, node: str) -> str:
    """Return the global name that a node means, without double slashes or a slash at its end.

    Args:
        name: the name that the node uses, not empty.
        node: the full name of the node, e.g. /robots/robotino
    """
    if is_global(name):
        return joined(parts(name))
    if is_private(name):
        return joined(parts(f"{node}{SEPARATOR}{name.removeprefix(_PRIVATE)}"))
    namespace = node.removesuffix(SEPARATOR).rpartition(SEPARATOR)[0]
    return f"{namespace}{SEPARATOR}{SEPARATOR.join(parts(name))}"
