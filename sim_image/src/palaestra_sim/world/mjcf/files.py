"""The files that a model names: meshes, textures, parts of the model.

MuJoCo opens what the attributes of a model name, wherever it is. A name may lead nowhere but into the folder
of the world: no absolute path, and no `..` that leaves a folder.
"""

from __future__ import annotations

import posixpath
from collections.abc import Iterator
from typing import Final

from palaestra_sim.errors import WorldError
from palaestra_sim.world.mjcf.elements import Element
from palaestra_sim.world.source import Source

_FILES: Final = frozenset(
    ("file", *(f"file{side}" for side in ("right", "left", "up", "down", "front", "back")))
)
_FOLDERS: Final = frozenset(("assetdir", "meshdir", "texturedir"))
_INSIDE: Final = "name a file beside the world or in a folder there, without .. and without a leading slash"
_PARTS: Final = frozenset(("include", "model"))


def named_files(root: Element) -> Iterator[tuple[Element, str]]:
    """Yield the names of files with their elements."""
    for element in root.walk():
        for attribute, value in element.attributes.items():
            if attribute in _FILES:
                yield element, value


def named_folders(root: Element) -> Iterator[tuple[Element, str]]:
    """Yield the names of folders in which MuJoCo looks for files, with their elements."""
    for element in root.walk():
        for attribute, value in element.attributes.items():
            if element.tag == "compiler" and attribute in _FOLDERS:
                yield element, value


def parts(root: Element) -> tuple[str, ...]:
    """Return the files of which MuJoCo reads more elements."""
    return tuple(value for element, value in named_files(root) if element.tag in _PARTS)


def strays(source: Source, root: Element) -> Iterator[WorldError]:
    """Yield an error for each name in a file that leads out of the folder of the world."""
    for element, path in (*named_files(root), *named_folders(root)):
        if not stays_inside(path):
            fact = f"{path!r} is outside of the folder of the world"
            yield source.error(element.start, fact, _INSIDE)


def stays_inside(path: str) -> bool:
    """Return whether a path leads into the folder that it starts from, or is that folder."""
    if "\\" in path or ":" in path or posixpath.isabs(path):
        return False
    return posixpath.normpath(path).partition("/")[0] != ".."
