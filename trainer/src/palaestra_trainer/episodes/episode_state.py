"""The state of an episode: its number and its actions so far, which reproduce the episode."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True, slots=True, eq=False)
class EpisodeState:
    """The position of a member in its episodes; a resume plays the episode up to this position again.

    Attributes:
        episode: number of the current episode, or of the next episode if `actions` is None.
        actions: the actions of the episode so far, shape (steps, *action), read-only; None: no episode runs.
        training_progress: share of the training that was complete when the episode began, 0 to 1.
    """

    episode: int
    actions: np.ndarray | None
    training_progress: float = 0.0


class ActionLog:
    """The actions of one episode, in an array that grows; reading the array does not copy the actions."""

    def __init__(self) -> None:
        self._rows = np.empty((0,))
        self._length = 0

    def append(self, action: Any) -> None:
        """Add one action; this does not change the arrays that `taken` returned before."""
        if self._length == len(self._rows):
            self._grow(np.asarray(action))
        self._rows[self._length] = action
        self._length += 1

    def taken(self) -> np.ndarray:
        """Return a view of the actions so far, shape (steps, *action)."""
        return self._rows[: self._length]

    def _grow(self, action: np.ndarray) -> None:
        larger = np.empty((max(16, 2 * self._length), *action.shape), action.dtype)
        if self._length:
            larger[: self._length] = self._rows
        self._rows = larger
