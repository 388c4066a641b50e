"""How far an episode is, in what brings it there again: its number, and the actions taken in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True, slots=True, eq=False)
class EpisodeState:
    """How far a member is, so that it can be brought there again through the environment's interface.

    Attributes:
        episode: number of the episode that is under way, or of the next one to begin.
        actions: those taken in it so far, shape (steps, *action), not to be written to; None: none is under
            way.
    """

    episode: int
    actions: np.ndarray | None


class ActionLog:
    """The actions of one episode, which can be looked at cheaply at any time."""

    def __init__(self) -> None:
        self._rows = np.empty((0,))
        self._length = 0

    def append(self, action: Any) -> None:
        """Add one action; what `taken` returned before stays as it is."""
        if self._length == len(self._rows):
            self._grow(np.asarray(action))
        self._rows[self._length] = action
        self._length += 1

    def taken(self) -> np.ndarray:
        """Return the actions so far, shape (steps, *action), a view."""
        return self._rows[: self._length]

    def _grow(self, action: np.ndarray) -> None:
        larger = np.empty((max(16, 2 * self._length), *action.shape), action.dtype)
        if self._length:
            larger[: self._length] = self._rows
        self._rows = larger
