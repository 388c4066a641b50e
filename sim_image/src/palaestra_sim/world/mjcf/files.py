"""The files that a model names: meshes, textures, parts of the model.

MuJoCo opens what the attributes of a model name, wherever it is. A name may lead nowhere but into the project
of the world, which is the folder around that of the world, as for Webots.
"""

from __future__ import annotations

import posixpath
from collections.abc import Iterable, Iterator, Sequence
from typing import Final

from palaestra_sim.errors import WorldError
from palaestra_sim.world.mjcf.elements import Element
from palaestra_sim.world.source import Source

_FILES: Final = frozenset(
    ("file", *(f"file{side}" for side in ("right", "left", "up", "down", "front", "back")))
)
_FOLDERS: Final = frozenset(("assetdir", "meshdir", "texturedir"))
_INSIDE: Final = (
    "name a file beside the world, or beside its folder, without a leading slash and with one .. at most"
)
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


def strays(
    source: Source, root: Element, folders: Iterable[str] = (), *, includes: bool = True
) -> Iterator[WorldError]:
    """Yield an error for each name in a file that leads out of the project of the world.

    Args:
        source: the file.
        root: its elements.
        folders: in which MuJoCo looks for files besides those that this file names.
        includes: whether names of more files with elements count; they may start beside the file itself.
    """
    named = [path for _, path in named_folders(root)]
    yield from _leaving(source, named_folders(root), [""])
    files = (row for row in named_files(root) if includes or row[0].tag not in _PARTS)
    yield from _leaving(source, files, ["", *folders, *named])


def in_project(path: str) -> bool:
    """Return whether a path from the folder of a world leads into that folder or the one around it."""
    if "\\" in path or ":" in path or posixpath.isabs(path):
        return False
    return not f"{posixpath.normpath(path)}/".startswith("../../")


def _leaving(
    source: Source, named: Iterable[tuple[Element, str]], folders: Sequence[str]
) -> Iterator[WorldError]:
    for element, path in named:
        if not all(in_project(path) and in_project(posixpath.join(folder, path)) for folder in folders):
            fact = f"{path!r} is outside of the project of the world"
            yield source.error(element.start, fact, _INSIDE)
