"""Rollout buffers of RecurrentPPO that do not sample invalid rows.

An LSTM learns from whole sequences, so rows are not shuffled. Sequences do not contain invalid rows. The
first valid row after an invalid row begins an episode. At that row the state of the LSTM is reset, both in
the collection of rows and in the update.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import numpy as np
from sb3_contrib.common.recurrent.buffers import RecurrentDictRolloutBuffer, RecurrentRolloutBuffer

from palaestra_trainer.algorithms.buffers import ValidRolloutBuffer, batches


class _Sequences(ValidRolloutBuffer):
    """A rollout buffer that yields minibatches of valid rows in their order."""

    def get(self, batch_size: int | None = None) -> Generator[Any, None, None]:
        """Yield minibatches of valid rows, from a random row on, as RecurrentPPO's own buffer does."""
        if not self.generator_ready:
            next(super(ValidRolloutBuffer, self).get(1))  # this call flattens the rows of all members
        rows = np.flatnonzero(self.swap_and_flatten(self.valid))
        first_of_member = np.zeros((self.buffer_size, self.n_envs))
        first_of_member[0] = 1.0
        draw: Any = self._get_samples  # Any, because the second argument differs from that of RolloutBuffer
        turned = np.roll(rows, -np.random.randint(len(rows)))
        for batch in batches(turned, batch_size or len(rows)):
            yield draw(batch, self.swap_and_flatten(first_of_member))


class ValidRecurrentRolloutBuffer(_Sequences, RecurrentRolloutBuffer):
    """The buffer for observations that are one array."""


class ValidRecurrentDictRolloutBuffer(_Sequences, RecurrentDictRolloutBuffer):
    """The buffer for observations that are a Dict."""
