"""The files of a model on disk, and its project: the folder that holds all these files.

Models of a package share meshes, so a model may name files in folders above its own folder. The project is
the nearest folder that holds all files that the model names, unless the user names a folder. The project is
never the whole file system, and no link may lead out of the project: an untrusted model must not read files
of the pod.
"""

from __future__ import annotations

import posixpath
from collections.abc import Iterator
from pathlib import Path
from typing import Final, NamedTuple

from palaestra_sim.errors import WorldError, refusal
from palaestra_sim.world.bounded_read import read_bounded
from palaestra_sim.world.mjcf.description import ARGUMENTS, Description, custom
from palaestra_sim.world.mjcf.elements import Element, read
from palaestra_sim.world.mjcf.files import absolutes, assets, named_folders, parts
from palaestra_sim.world.mjcf.part_files import PartFiles
from palaestra_sim.world.mjcf.size_checks import growing
from palaestra_sim.world.paths import climb, is_relative
from palaestra_sim.world.source import Source

_NEXT_TO_IT: Final = "put it next to the world, or next to this file"
_TOGETHER: Final = (
    "copy it next to the world, or name a folder that holds both (--root, or world.root of a job)"
)
_SMALLER: Final = "attach fewer models, and no model to itself"


class _Named(NamedTuple):
    """An existing file, and the element that names it; `path` is relative to the folder of the world."""

    source: Source
    element: Element
    path: str

    def error(self, fact: str) -> WorldError:
        return self.source.error(self.element.start, f"{self.path!r} leads to {fact}", _TOGETHER)


class Project:
    """The files of a model, and of the files that it includes.

    MuJoCo looks for an included file next to the world, then in the folders that the world names, then next
    to the file that includes it.

    Args:
        world: path of the world.
        description: the description of the model's main file.
        root: the folder that the user names; None for the nearest folder that holds all files.

    Attributes:
        roots: the elements of the included files that were read.
    """

    def __init__(self, world: Path, description: Description, root: Path | None = None) -> None:
        self.roots: list[Element] = []
        self._folder = world.absolute().parent
        self._main = world.name
        self._root = root
        self._description = description
        self._named: list[_Named] = []
        # The elements of `custom` in the files so far: tag and name, and the file.
        self._customs: dict[tuple[str, str], str] = {}

    def open(self) -> None:
        """Read all included files, and check that all files are inside the project.

        Raises:
            WorldError: an included file is wrong, or a file is outside of the project.
            OSError: an included file cannot be read.
        """
        if error := refusal(self._read()) or refusal(self._strays()):
            raise error

    def _read(self) -> Iterator[WorldError]:
        """Read all included files; yield their errors."""
        description = self._description
        files = PartFiles(self._main, description.root)
        waiting = [(self._main, description.source, description.root)]
        list(self._repeated(description.source, description.root))  # `check` reports those of this file
        seen: set[str] = set()
        while waiting:
            place, source, root = waiting.pop()
            folder_of_file = posixpath.dirname(place)
            self._note_assets(source, root, folder_of_file)
            for element, part in parts(root):
                found = next(self._there(part, [*self._folders(description.root), folder_of_file]), None)
                if found is None:
                    fact = f"the file {part!r}, which is part of the model, is missing"
                    yield source.error(element.start, fact, _NEXT_TO_IT)
                    continue
                self._named.append(named := _Named(source, element, found))
                files.add(place, found)
                if found not in seen and not self._is_outside(named, self._root):
                    seen.add(found)
                    inner = Source(data=read_bounded(self._folder / found), name=part)
                    elements = read(inner)
                    self.roots.append(elements)
                    files.read(found, elements)
                    yield from absolutes(inner, elements)
                    yield from growing(inner, elements)
                    if element.tag == "include":  # an attached model has names of its own
                        yield from self._repeated(inner, elements)
                    waiting.append((found, inner, elements))
        if (trouble := files.trouble()) is not None:
            yield description.source.error(description.root.start, trouble, _SMALLER)

    def _repeated(self, source: Source, root: Element) -> Iterator[WorldError]:
        """Yield an error for each name in `custom` that was used before, because MuJoCo refuses the model."""
        for tag in ("text", "numeric"):
            for name, element in custom(root, tag):
                first = self._customs.setdefault((tag, name), source.name)
                if first == source.name:
                    continue
                remedy = "remove one"
                if name == ARGUMENTS:
                    remedy = "remove this one, because a simulator's world always has its own"
                yield source.error(element.start, f"{first} has a {tag} with the name {name!r} too", remedy)

    @property
    def levels(self) -> int:
        """The number of folders by which the files lead above the folder of the world."""
        return max((climb(named.path) for named in self._named), default=0)

    def _strays(self) -> Iterator[WorldError]:
        """Yield an error for each file outside the project."""
        nearest = None if self.levels >= self._top else (self._folder, *self._folder.parents)[self.levels]
        root = self._root or nearest
        for named in self._named:
            if self._is_outside(named, root):
                where = "the root of the file system"
                if root is not None:
                    where = f"{self._real(named)}, which is outside of {root}"
                yield named.error(where)

    @property
    def _top(self) -> int:
        """The number of levels at which the project would be the whole file system."""
        return max(1, len(self._folder.parents))

    def _is_outside(self, named: _Named, root: Path | None) -> bool:
        """Return whether a file is outside `root`; if `root` is None, only a path to the top is outside."""
        if root is None:
            return climb(named.path) >= self._top
        return not self._real(named).is_relative_to(root.resolve())

    def _real(self, named: _Named) -> Path:
        return (self._folder / named.path).resolve()

    def _note_assets(self, source: Source, root: Element, folder_of_file: str) -> None:
        """Record the existing meshes, textures and other assets that a file in `folder_of_file` names.

        The assets of an attached model are next to that model.
        """
        named = [*self._folders(self._description.root), *self._folders(root)[1:]]
        folders = named + [posixpath.join(folder_of_file, folder) for folder in named if folder_of_file]
        for element, path in assets(root):
            self._named += (_Named(source, element, found) for found in self._there(path, folders))

    def _folders(self, root: Element) -> list[str]:
        """Return the folders in which MuJoCo looks for files that elements name."""
        return ["", *(path for _, path in named_folders(root) if is_relative(path))]

    def _there(self, path: str, folders: list[str]) -> Iterator[str]:
        """Yield the paths of existing files, relative to the world's folder."""
        if is_relative(path):
            for at in folders:
                found = posixpath.normpath(posixpath.join(at, path))
                if (self._folder / found).is_file():
                    yield found
