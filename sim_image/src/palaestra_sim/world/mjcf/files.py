"""The files that a model names: meshes, textures, parts of the model.

MuJoCo opens every file that an attribute of a model names. A name is relative to the folder of the world, or
to a folder that the model names. `project` refuses files outside of the model's project.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from palaestra_sim.errors import WorldError
from palaestra_sim.world.mjcf.elements import Element
from palaestra_sim.world.paths import is_relative
from palaestra_sim.world.source import Source

_FILES: Final = frozenset(
    ("file", *(f"file{side}" for side in ("right", "left", "up", "down", "front", "back")))
)
_FOLDERS: Final = frozenset(("assetdir", "meshdir", "texturedir"))
_RELATIVE: Final = "write its path from the folder of the world, such as ../meshes/arm.stl"
_PARTS: Final = frozenset(("include", "model"))


def named_files(root: Element) -> Iterator[tuple[Element, str]]:
    """Yield the name of each file, with the element that names the file."""
    for element in root.walk():
        for attribute, value in element.attributes.items():
            if attribute in _FILES:
                yield element, value


def named_folders(root: Element) -> Iterator[tuple[Element, str]]:
    """Yield each name of a folder in which MuJoCo looks for files, with the element that has this name."""
    for element in root.walk():
        for attribute, value in element.attributes.items():
            if element.tag == "compiler" and attribute in _FOLDERS:
                yield element, value


def parts(root: Element) -> tuple[tuple[Element, str], ...]:
    """Return the name of each file from which MuJoCo reads more elements, with the element that names it."""
    return tuple(row for row in named_files(root) if row[0].tag in _PARTS)


def assets(root: Element) -> Iterator[tuple[Element, str]]:
    """Yield the name of each file without elements, such as a mesh, with the element that names the file."""
    return (row for row in named_files(root) if row[0].tag not in _PARTS)


def absolutes(source: Source, root: Element) -> Iterator[WorldError]:
    """Yield an error for each file name that is not relative to the folder of the world."""
    for element, path in (*named_folders(root), *named_files(root)):
        if not is_relative(path):
            fact = f"{path!r} is not relative to the folder of the world"
            yield source.error(element.start, fact, _RELATIVE)
