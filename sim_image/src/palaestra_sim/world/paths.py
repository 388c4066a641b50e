"""Paths that a world names, which are relative to the world's folder and may lead above this folder."""

from __future__ import annotations

import posixpath
from itertools import takewhile


def is_relative(path: str) -> bool:
    """Return whether a path is relative to the folder of the file that names it."""
    return not ("\\" in path or ":" in path or posixpath.isabs(path))


def climb(path: str) -> int:
    """Return the number of folders by which a relative path leads above its folder."""
    return sum(1 for _ in takewhile("..".__eq__, posixpath.normpath(path).split("/")))
