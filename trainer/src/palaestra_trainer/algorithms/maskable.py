"""MaskablePPO's rollouts without invalid rows.

A row has the mask that its action was chosen by. While a simulator is mended, its rows have masks that allow
every action; these rows reach no loss.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import numpy as np
from sb3_contrib.common.maskable.buffers import MaskableDictRolloutBuffer, MaskableRolloutBuffer

from palaestra_trainer.algorithms.buffers import ValidRolloutBuffer, batches


class _Masked(ValidRolloutBuffer):
    """A rollout buffer of rows with masks."""

    def get(self, batch_size: int | None = None) -> Generator[Any, None, None]:
        """Yield minibatches of valid rows in random order; a single last row joins the one before it.

        Unlike PPO, MaskablePPO takes the deviation of a single advantage, which is NaN.
        """
        if not self.generator_ready:
            next(super(ValidRolloutBuffer, self).get(1))  # flattens the rows of all members into one column
        rows = np.random.permutation(np.flatnonzero(self.swap_and_flatten(self.valid)))
        for batch in batches(rows, batch_size or max(len(rows), 1)):
            yield self._get_samples(batch)


class ValidMaskableRolloutBuffer(_Masked, MaskableRolloutBuffer):
    """The buffer for observations that are one array."""


class ValidMaskableDictRolloutBuffer(_Masked, MaskableDictRolloutBuffer):
    """The buffer for observations that are a Dict."""
