"""The facades that environments may use: open ones that this process created for itself.

In a notebook, an environment that is made after `Webots(...)` is meant for that simulator. A facade is
offered until it is closed, except while an environment has it. A forked process is offered none of its
parent's.
"""

from __future__ import annotations

import itertools
import os
from typing import TYPE_CHECKING
from weakref import WeakSet, WeakValueDictionary

if TYPE_CHECKING:
    from palaestra_trainer.webots.facade import Webots

_numbers = itertools.count()
_open: WeakValueDictionary[tuple[int, int], Webots] = WeakValueDictionary()  # by process and number
_taken: WeakSet[Webots] = WeakSet()


def offer(webots: Webots) -> None:
    """Offer a new facade to environments."""
    _open[os.getpid(), next(_numbers)] = webots


def withdraw(webots: Webots) -> None:
    """Offer a facade to no environment any more; safe to repeat."""
    for key, known in list(_open.items()):
        if known is webots:
            _open.pop(key, None)


def offered() -> Webots | None:
    """Return the newest facade that no environment has; None: there is none."""
    mine = sorted(key for key in list(_open.keys()) if key[0] == os.getpid())
    free = (known for key in reversed(mine) if (known := _open.get(key)) is not None and known not in _taken)
    return next(free, None)


def take(webots: Webots) -> None:
    """Reserve a facade for one environment."""
    _taken.add(webots)


def give_back(webots: Webots) -> None:
    """Offer a facade again, unless it was closed or withdrawn."""
    _taken.discard(webots)
