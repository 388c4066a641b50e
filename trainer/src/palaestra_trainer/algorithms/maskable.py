"""MaskablePPO's rollouts without invalid rows.

A row has the mask with which its action was chosen. While a simulator restarts, its rows have masks that
allow every action; these rows reach no loss.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from sb3_contrib.common.maskable.buffers import MaskableDictRolloutBuffer, MaskableRolloutBuffer

from palaestra_trainer.algorithms.buffers import ValidRolloutBuffer, batches


class _Masked(ValidRolloutBuffer):
    """A rollout buffer of rows with masks."""

    def _parts(self, rows: np.ndarray, size: int) -> Iterator[np.ndarray]:
        """Yield `rows` in parts of `size`; a single last row joins the part before it.

        Unlike PPO, MaskablePPO computes the deviation even of a single advantage, which is NaN.
        """
        return batches(rows, size)


class ValidMaskableRolloutBuffer(_Masked, MaskableRolloutBuffer):
    """The buffer for observations that are one array."""


class ValidMaskableDictRolloutBuffer(_Masked, MaskableDictRolloutBuffer):
    """The buffer for observations that are a Dict."""
