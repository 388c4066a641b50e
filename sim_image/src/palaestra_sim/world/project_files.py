"""The files that the nodes of a world name, such as the images of textures, inside the project of the world.

The sidecar puts a generated world into a folder of links to the files next to the source world. This module
follows such a link to the source project, but refuses every other link that leads out of the project. The
project is never the whole file system.
"""

from __future__ import annotations

import errno
import posixpath
from collections.abc import Callable
from pathlib import Path

from palaestra_sim.world.bounded_read import read_bounded
from palaestra_sim.world.paths import is_relative
from palaestra_sim.world.root import placed, root_of
from palaestra_sim.world.source import Source

ReadFile = Callable[[Source, str], bytes]
"""Returns the bytes of the file at an address that a world or a PROTO file names; may raise OSError."""


class ProjectFiles:
    """The files of one world.

    Args:
        world_path: the path of the world.
        source: the bytes of the world.
    """

    def __init__(self, world_path: Path, source: bytes) -> None:
        self._world = placed(world_path)
        self._source = source
        self._root: Path | None = None

    def read(self, namer: Source, address: str) -> bytes:
        """Return the bytes of the file at an address that a world or a PROTO file names.

        Raises:
            OSError: the file cannot be read, is not a regular file, is too large, or is outside of
                the project.
        """
        if not is_relative(address) or "\0" in address:
            raise OSError(errno.EINVAL, "is not a path relative to the file that names it", address)
        namer_path = Path(namer.name) if namer.kind == "PROTO" else self._world
        return read_bounded(self._inside(Path(posixpath.normpath(namer_path.parent / address))))

    def _inside(self, path: Path) -> Path:
        """Return the path of a file after all links are followed."""
        if self._root is None:
            found = root_of(self._world, self._source)
            self._root = found if found != found.parent else self._world.parent
        root = self._root
        if not path.is_relative_to(root):
            raise OSError(errno.EACCES, f"is outside of the project {root}", str(path))
        parts = path.relative_to(root).parts
        for depth in range(1, len(parts) + 1):
            link = root.joinpath(*parts[:depth])
            if link.is_symlink() and (target := link.readlink()).is_absolute() and target.name == link.name:
                root, path = target.parents[depth - 1], target.joinpath(*parts[depth:])
                break
        found = path.resolve(strict=True)
        if not found.is_relative_to(root.resolve()):
            raise OSError(errno.EACCES, f"is outside of the project {root}", str(path))
        return found
