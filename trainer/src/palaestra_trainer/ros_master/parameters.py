"""The tree of parameters, in which a namespace is a dictionary and a parameter is any other value.

The functions are pure, and no dictionary is ever changed: a change creates new dictionaries from the
parameter up to the root. So a tree that was returned, or is being sent to a node, stays the same.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from palaestra_trainer.ros_master.names import SEPARATOR, below, is_global, is_private, joined, parts

Tree = dict[str, Any]


class Change(NamedTuple):
    """A change to report to the subscribers of a name: a parameter and its value, `{}` after a deletion.

    Attributes:
        subscribed: the name to which the nodes subscribe; it ends with a slash.
        name: the name of the parameter or namespace that has changed; it ends with a slash.
        value: the new value of that parameter or namespace.
        by_caller: whether the change is at or below the subscribed name; then the node that made the change
            does not get an update.
    """

    subscribed: str
    name: str
    value: Any
    by_caller: bool


class Parameters:
    """The parameters of one master; all names are global, except for the key of `search`."""

    def __init__(self) -> None:
        self._root: Tree = {}

    def get(self, name: str) -> Any:
        """Return the value of a parameter, or the tree of a namespace.

        Raises:
            KeyError: the name is not set.
        """
        value: Any = self._root
        for part in parts(name):
            if not isinstance(value, dict):
                raise KeyError(name)
            value = value[part]
        return value

    def has(self, name: str) -> bool:
        """Return whether a parameter or namespace exists."""
        try:
            self.get(name)
        except KeyError:
            return False
        return True

    def set(self, name: str, value: Any) -> None:
        """Set a parameter; a dictionary replaces the whole namespace.

        If a part of the name is a parameter, it becomes a namespace.

        Raises:
            TypeError: `name` is the root, and `value` is not a dictionary.
        """
        path = parts(name)
        if not path and not isinstance(value, dict):
            raise TypeError("the root of the parameters must be a dictionary")
        self._root = _with(self._root, path, value)

    def delete(self, name: str) -> None:
        """Delete a parameter or namespace.

        Raises:
            KeyError: the name is not set, or is the root.
        """
        path = parts(name)
        if not path or not self.has(name):
            raise KeyError(name)
        self._root = _without(self._root, path)

    def search(self, key: str, node: str) -> str | None:
        """Return the global name of the parameter nearest to a node; None if no parameter matches.

        The search goes from the node's own name up to the root, until a namespace has the first part of
        `key`.

        Args:
            key: a relative name; a global name is only looked up.
            node: the full name of the node.

        Raises:
            ValueError: the key is private, or the node's name is not global.
        """
        if is_private(key) or not is_global(node):
            raise ValueError(f"{key} cannot be searched for from {node}")
        if is_global(key):
            return key if self.has(key) else None
        first = parts(key)[0]
        path = parts(node)
        for length in range(len(path), -1, -1):
            if self.has(joined((*path[:length], first))):
                return joined((*path[:length], key))
        return None

    def names(self) -> list[str]:
        """Return the names of all parameters."""
        return list(_names(SEPARATOR, self._root))


def changes(name: str, value: Any, subscribed: list[str]) -> Iterator[Change]:
    """Yield the change for each subscribed name after `name` was set, or was deleted (`value` is `{}`).

    Args:
        name: the name of the parameter or namespace.
        value: the new value of that parameter or namespace.
        subscribed: names to which nodes subscribe; each ends with a slash.
    """
    top = as_subscribed(name)
    inside = dict(_values(top, value)) if isinstance(value, dict) else None
    for wanted in subscribed:
        if top.startswith(wanted):
            yield Change(wanted, top, value, by_caller=True)
        elif inside is not None and wanted.startswith(top):
            yield Change(wanted, wanted, inside.get(wanted, {}), by_caller=False)


def as_subscribed(name: str) -> str:
    """Return a global name with a slash at its end; name A is then below B if A begins with B."""
    return SEPARATOR.join(("", *parts(name), ""))


def _with(tree: Mapping[str, Any], path: tuple[str, ...], value: Any) -> Any:
    if not path:
        return value
    first, *rest = path
    inner = tree.get(first)
    return {**tree, first: _with(inner if isinstance(inner, dict) else {}, tuple(rest), value)}


def _without(tree: Mapping[str, Any], path: tuple[str, ...]) -> Tree:
    first, *rest = path
    if rest:
        return {**tree, first: _without(tree[first], tuple(rest))}
    return {name: value for name, value in tree.items() if name != first}


def _names(namespace: str, tree: Mapping[str, Any]) -> Iterator[str]:
    for part, value in tree.items():
        name = below(namespace, part)
        if isinstance(value, dict):
            yield from _names(name, value)
        else:
            yield name


def _values(namespace: str, tree: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield the name, with a slash at its end, and the value of each entry inside a namespace."""
    for part, value in tree.items():
        name = f"{below(namespace, part)}{SEPARATOR}"
        yield name, value
        if isinstance(value, dict):
            yield from _values(name, value)
