"""The actions of steps that have not ended, for off-policy algorithms with asynchronous collection."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from palaestra_trainer.environments.infos import is_pending


class BegunActions:
    """The actions with which pending steps began; the algorithm has drawn other actions since then."""

    def __init__(self) -> None:
        self._actions: dict[int, np.ndarray] = {}

    def taken(self, actions: np.ndarray, infos: Sequence[Mapping[str, Any]]) -> np.ndarray:
        """Return, for each row of a vector step, the action with which its step began; shaped as `actions`.

        The actions of pending rows are kept until their steps end.
        """
        begun = {row: self._actions.pop(row) for row in [*self._actions] if not is_pending(infos[row])}
        for row, info in enumerate(infos):
            if is_pending(info):
                self._actions.setdefault(row, actions[row].copy())
        taken = actions.copy() if begun else actions
        for row, action in begun.items():
            taken[row] = action
        return taken
