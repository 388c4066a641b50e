"""The registry of this process's open facades; environments may use these facades.

If a notebook creates an environment after `Webots(...)`, the environment should use the simulator of this
facade. A facade is offered until it is closed, except while an environment uses it. A forked process does not
use the facades of its parent.
"""

from __future__ import annotations

import itertools
import os
from typing import Generic, TypeVar
from weakref import WeakSet, WeakValueDictionary

Facade = TypeVar("Facade")


class FacadeRegistry(Generic[Facade]):
    """The open facades of this process and its parents, by weak references."""

    def __init__(self) -> None:
        self._numbers = itertools.count()
        # Keys: process id and number.
        self._open: WeakValueDictionary[tuple[int, int], Facade] = WeakValueDictionary()
        self._taken: WeakSet[Facade] = WeakSet()

    def offer(self, facade: Facade) -> None:
        """Offer a new facade to environments."""
        self._open[os.getpid(), next(self._numbers)] = facade

    def withdraw(self, facade: Facade) -> None:
        """Stop offering a facade to environments; further calls have no effect."""
        for key, known in list(self._open.items()):
            if known is facade:
                self._open.pop(key, None)

    def offered(self) -> Facade | None:
        """Return the newest open facade that no environment uses; None without such a facade."""
        mine = sorted(key for key in list(self._open.keys()) if key[0] == os.getpid())
        known = (self._open.get(key) for key in reversed(mine))
        return next((facade for facade in known if facade is not None and facade not in self._taken), None)

    def take(self, facade: Facade) -> None:
        """Reserve a facade for one environment."""
        self._taken.add(facade)

    def give_back(self, facade: Facade) -> None:
        """Offer a facade again, unless it was closed or withdrawn."""
        self._taken.discard(facade)
