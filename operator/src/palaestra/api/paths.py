"""Paths of fields in messages, and a copy of plain data from which values can be removed.

The path `spec.simulators[1].role` is the tuple `("spec", "simulators", 1, "role")`.
"""

import json
import re
from typing import Any

Path = tuple[str | int, ...]

_PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def shown(path: Path) -> str:
    """Return `path` as text, such as `a.b[1]["c.d"]`; a key that is not a plain word is in brackets."""
    text = ""
    for piece in path:
        if isinstance(piece, int):
            text += f"[{piece}]"
        elif _PLAIN.fullmatch(piece):
            text += f".{piece}" if text else piece
        else:
            text += f"[{json.dumps(piece, ensure_ascii=False)}]"
    return text


_PIECE = re.compile(r'(?:^|(?!^)\.)([A-Za-z_][A-Za-z0-9_]*)|\[([0-9]+)\]|\[("(?:[^"\\]|\\.)*")\]')


def path_of(text: str) -> Path:
    """Return the path for a text from `shown`; empty if `text` is not a path."""
    pieces: list[str | int] = []
    at = 0
    while at < len(text):
        found = _PIECE.match(text, at)
        if found is None:
            return ()
        name, index, key = found.groups()
        try:
            pieces.append(name or (int(index) if index else json.loads(key)))
        except ValueError:  # the quoted key is not a JSON string, for example because of its escapes
            return ()
        at = found.end()
    return tuple(pieces)


class Pruned:
    """A copy of plain data from which values can be removed.

    Lists are stored as mappings from index to item, so that the remaining items keep their original indices.
    """

    def __init__(self, data: Any) -> None:
        self._tree = _sparse(data)

    def take(self, path: Path, stand_in: Any = None) -> bool:
        """Remove the value at `path`; return False if it did not exist.

        If a `stand_in` is given, replace the value by the stand-in; return False if the stand-in was already
        there.
        """
        *above, last = path
        tree = self._tree
        for piece in above:
            if not isinstance(tree, dict) or piece not in tree:
                return False
            tree = tree[piece]
        if not isinstance(tree, dict):
            return False
        if stand_in is None:
            return tree.pop(last, _NOTHING) is not _NOTHING
        changed: bool = tree.get(last, _NOTHING) != stand_in
        tree[last] = stand_in
        return changed

    def data(self) -> Any:
        """Return the remaining values as plain data."""
        return _dense(self._tree)

    def original(self, path: Path) -> Path:
        """Return the original path of the value at `path` in `data()`."""
        tree, found = self._tree, []
        for piece in path:
            if isinstance(tree, _SparseList) and isinstance(piece, int):
                found.append(list(tree)[piece])
            else:
                found.append(piece)
            tree = tree.get(found[-1]) if isinstance(tree, dict) else None
        return tuple(found)


_NOTHING = object()


class _SparseList(dict[Any, Any]):
    """The remaining items of a list, by their original index."""


def _sparse(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _sparse(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return _SparseList((index, _sparse(item)) for index, item in enumerate(data))
    return data


def _dense(tree: Any) -> Any:
    if isinstance(tree, _SparseList):
        return [_dense(item) for item in tree.values()]
    if isinstance(tree, dict):
        return {key: _dense(value) for key, value in tree.items()}
    return tree
