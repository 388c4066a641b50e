"""The actions of many rows since the start of their episodes, in one array."""

from __future__ import annotations

from typing import Any

import numpy as np

_FEWEST = 64


class RowLog:
    """The actions of `rows` rows, one array for each step of all rows.

    Reading a row's actions does not copy them; later steps do not change an array that was read.

    Args:
        rows: the number of rows.
    """

    def __init__(self, rows: int) -> None:
        self._rows = rows
        self._taken = np.empty((0, rows))
        self._length = 0
        self._begun = np.zeros(rows, dtype=np.int64)

    def begin(self, rows: Any) -> None:
        """Begin an episode in rows."""
        self._begun[rows] = self._length

    def append(self, actions: np.ndarray) -> None:
        """Add the actions of one step, (rows, *action)."""
        if self._length == len(self._taken):
            self._grow(actions)
        self._taken[self._length] = actions
        self._length += 1

    def of_row(self, row: int) -> np.ndarray:
        """Return the actions of a row's episode so far, (steps, *action)."""
        return self._taken[self._begun[row] : self._length, row]

    def lengths(self) -> np.ndarray:
        """Return the number of steps of each row's episode so far."""
        return self._length - self._begun

    def _grow(self, actions: np.ndarray) -> None:
        """Copy the steps that are still needed to a new array; a caller may still read the old array."""
        first = int(self._begun.min())
        kept = self._taken[first : self._length]
        larger = np.empty((max(_FEWEST, 2 * len(kept)), *actions.shape), actions.dtype)
        if len(kept):
            larger[: len(kept)] = kept
        self._taken, self._length = larger, len(kept)
        self._begun -= first
