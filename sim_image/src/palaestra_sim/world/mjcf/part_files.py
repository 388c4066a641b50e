"""Count the copies of each file in a model.

If a model attaches itself, MuJoCo attaches the model without end. In a chain of files, each file may attach
the next file twice; then a few files make more bodies than fit into memory.
"""

from __future__ import annotations

from graphlib import CycleError, TopologicalSorter
from typing import Final

from palaestra_sim.world.mjcf.elements import Element

_MOST: Final = 1_000_000  # maximum number of elements of a model, including all copies


class PartFiles:
    """The files of a model, and the files that each of them names.

    Args:
        main: path of the world.
        root: the elements of the world.
    """

    def __init__(self, main: str, root: Element) -> None:
        self._main = main
        self._sizes: dict[str, int] = {}
        self._attaches: dict[str, int] = {}
        self._named_by: dict[str, set[str]] = {main: set()}
        self.read(main, root)

    def read(self, path: str, root: Element) -> None:
        """Count the elements of a file."""
        tags = [element.tag for element in root.walk()]
        self._sizes[path] = len(tags)
        self._attaches[path] = max(1, tags.count("attach"))

    def add(self, path: str, part: str) -> None:
        """Record that the file `path` names the file `part` as a part of the model."""
        self._named_by.setdefault(part, set()).add(path)

    def trouble(self) -> str | None:
        """Return the problem of a model that contains itself or has too many elements; else None."""
        try:
            order = list(TopologicalSorter(self._named_by).static_order())
        except CycleError as error:
            circle = ", ".join(sorted(set(error.args[1])))
            return f"the model contains itself: {circle}"
        copies = {self._main: 1}
        for path in order:
            for above in self._named_by.get(path, ()):
                copies[path] = copies.get(path, 0) + copies.get(above, 0) * self._attaches.get(above, 1)
        total = sum(copies.get(path, 0) * size for path, size in self._sizes.items())
        return f"the attached models have {total} elements; the limit is {_MOST}" if total > _MOST else None
