"""Paths that a world names: they count from its folder, and may lead above it."""

from __future__ import annotations

import posixpath
from itertools import takewhile


def is_relative(path: str) -> bool:
    """Return whether a path counts from the folder of the file that names it."""
    return not ("\\" in path or ":" in path or posixpath.isabs(path))


def climb(path: str) -> int:
    """Return by how many folders a relative path leads above the one from which it counts."""
    return sum(1 for _ in takewhile("..".__eq__, posixpath.normpath(path).split("/")))
