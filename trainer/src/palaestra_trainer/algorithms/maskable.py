"""Rollout buffers of MaskablePPO that do not sample invalid rows.

Each row has the mask with which its action was chosen. While a simulator restarts, the masks of its rows
allow every action. These rows are invalid, so they do not affect a loss.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from sb3_contrib.common.maskable.buffers import MaskableDictRolloutBuffer, MaskableRolloutBuffer

from palaestra_trainer.algorithms.buffers import ValidRolloutBuffer, batches


class _Masked(ValidRolloutBuffer):
    """A rollout buffer whose rows have masks."""

    def _parts(self, rows: np.ndarray, size: int) -> Iterator[np.ndarray]:
        """Yield `rows` in parts of `size`; add a single last row to the part before it.

        Unlike PPO, MaskablePPO also normalizes the advantage of a single row, and the standard deviation of a
        single advantage is NaN.
        """
        return batches(rows, size)


class ValidMaskableRolloutBuffer(_Masked, MaskableRolloutBuffer):
    """The buffer for observations that are one array."""


class ValidMaskableDictRolloutBuffer(_Masked, MaskableDictRolloutBuffer):
    """The buffer for observations that are a Dict."""
