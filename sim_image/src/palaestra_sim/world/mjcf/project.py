"""The files of a model on a disk, and its project: the folder that holds them all.

Models of a package share meshes, so a model may name files some folders above its own. The project is the
nearest folder that holds all that the model names, unless the user names one. It is never the whole file
system, and no link leads out of it: a model of a stranger must not read files of the pod.
"""

from __future__ import annotations

import posixpath
from collections.abc import Iterator
from pathlib import Path
from typing import Final, NamedTuple

from palaestra_sim.errors import WorldError, refusal
from palaestra_sim.world.bounded_read import read_bounded
from palaestra_sim.world.mjcf.description import Description
from palaestra_sim.world.mjcf.elements import Element, read
from palaestra_sim.world.mjcf.files import absolutes, assets, named_folders, parts
from palaestra_sim.world.mjcf.size_checks import growing
from palaestra_sim.world.paths import climb, is_relative
from palaestra_sim.world.source import Source

_BESIDE: Final = "put it beside the world, or beside this file"
_TOGETHER: Final = (
    "copy it beside the world, or name a folder that holds both (--root, or world.root of a job)"
)


class _Named(NamedTuple):
    """A file that is there, with the place that names it; `path` counts from the folder of the world."""

    source: Source
    element: Element
    path: str

    def error(self, fact: str) -> WorldError:
        return self.source.error(self.element.start, f"{self.path!r} leads to {fact}", _TOGETHER)


class Project:
    """The files of a model, and of the files that it includes.

    MuJoCo looks for an included file beside the world, then in the folders that the world names, then beside
    the file that includes it.

    Args:
        world: path of the world.
        description: its main file.
        root: the folder that the user names; None: the nearest one that holds all files.

    Attributes:
        roots: the elements of the included files that were read.
    """

    def __init__(self, world: Path, description: Description, root: Path | None = None) -> None:
        self.roots: list[Element] = []
        self._folder = world.absolute().parent
        self._root = root
        self._description = description
        self._named: list[_Named] = []

    def open(self) -> None:
        """Read all included files, and look where all files are.

        Raises:
            WorldError: an included file is wrong, or a file is outside of the project.
            OSError: an included file cannot be read.
        """
        if error := refusal(self._read()) or refusal(self._strays()):
            raise error

    def _read(self) -> Iterator[WorldError]:
        """Read all included files; yield what is wrong with them."""
        description = self._description
        waiting = [("", description.source, description.root)]
        seen: set[str] = set()
        while waiting:
            beside, source, root = waiting.pop()
            self._note_assets(source, root, beside)
            for element, part in parts(root):
                found = next(self._there(part, [*self._folders(description.root), beside]), None)
                if found is None:
                    fact = f"the file {part!r}, of which the model consists too, is missing"
                    yield source.error(element.start, fact, _BESIDE)
                    continue
                self._named.append(named := _Named(source, element, found))
                if found not in seen and not self._is_outside(named, self._root):
                    seen.add(found)
                    inner = Source(data=read_bounded(self._folder / found), name=part)
                    elements = read(inner)
                    self.roots.append(elements)
                    yield from absolutes(inner, elements)
                    yield from growing(inner, elements)
                    waiting.append((posixpath.dirname(found), inner, elements))

    @property
    def levels(self) -> int:
        """By how many folders the files lead above that of the world."""
        return max((climb(named.path) for named in self._named), default=0)

    def _strays(self) -> Iterator[WorldError]:
        """Yield an error for each file that is outside of the project."""
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
        """The levels at which the project would be the whole file system."""
        return max(1, len(self._folder.parents))

    def _is_outside(self, named: _Named, root: Path | None) -> bool:
        """Return whether a file is outside of `root`; None: still unknown, so only a path to the top is."""
        if root is None:
            return climb(named.path) >= self._top
        return not self._real(named).is_relative_to(root.resolve())

    def _real(self, named: _Named) -> Path:
        return (self._folder / named.path).resolve()

    def _note_assets(self, source: Source, root: Element, beside: str) -> None:
        """Note what is there of the meshes, textures and the like that a file in the folder `beside` names.

        Of an attached model they are beside that model.
        """
        named = [*self._folders(self._description.root), *self._folders(root)[1:]]
        folders = named + [posixpath.join(beside, folder) for folder in named if beside]
        for element, path in assets(root):
            self._named += (_Named(source, element, found) for found in self._there(path, folders))

    def _folders(self, root: Element) -> list[str]:
        """Return the folders in which MuJoCo looks for files that elements name."""
        return ["", *(path for _, path in named_folders(root) if is_relative(path))]

    def _there(self, path: str, folders: list[str]) -> Iterator[str]:
        """Yield the paths at which a file is, from the world's folder."""
        if is_relative(path):
            for at in folders:
                found = posixpath.normpath(posixpath.join(at, path))
                if (self._folder / found).is_file():
                    yield found
