"""Buffers from which algorithms sample only valid rows, so a fault does not affect a loss.

A row is invalid if its simulator failed during the step. The episode is truncated before an invalid row. The
learner bootstraps the value after the last valid row, so the policy is not punished for the fault.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.buffers import (
    DictReplayBuffer,
    DictRolloutBuffer,
    ReplayBuffer,
    RolloutBuffer,
)

from palaestra_trainer.algorithms.observations import by_name, part
from palaestra_trainer.environments.infos import is_pending, is_valid


def valid_rows(infos: Sequence[dict[str, Any]]) -> np.ndarray:
    """Return a mask of the valid rows of a vector step; shape (n_envs,), bool."""
    return np.array([is_valid(info) for info in infos], dtype=bool)


COLUMNS = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")
# With chunks of this size, a million rows need only a few dozen files, and a few new rows are cheap to save.
CHUNK_BYTES = 4 << 20


class Positions(NamedTuple):
    """The write positions of a replay buffer.

    Attributes:
        next: number of the row for the next step.
        full: whether every row is in use; if not, only the rows before `next` are in use.
        newest: for each member, the number of the row of its last step; None if the buffer does not hold that
            row.
        columns: for each member, the number of the next row in its column, and whether that column is full;
            empty for a buffer without columns.
    """

    next: int
    full: bool
    newest: tuple[int | None, ...]
    columns: tuple[tuple[int, bool], ...] = ()

    @classmethod
    def from_json(cls, content: Sequence[Any]) -> Positions:
        """Return the positions from their JSON data."""
        row, full, newest, columns = content
        return cls(row, full, tuple(newest), tuple((at, filled) for at, filled in columns))


class ValidReplayBuffer(ReplayBuffer):
    """A replay buffer that stores the valid rows of all members one after the other.

    The buffer has only one column, because a step of n members may append fewer than n rows. A checkpoint
    stores the rows in chunks, and only changed chunks are written again.

    Attributes:
        chunk_rows: number of rows of one chunk; the last chunk may have fewer.
        changed: numbers of the chunks that have changed; clear this set after saving the chunks.
    """

    def __init__(
        self,
        buffer_size: int,
        observation_space: spaces.Space[Any],
        action_space: spaces.Space[Any],
        device: torch.device | str = "auto",
        n_envs: int = 1,
        **options: Any,
    ) -> None:
        super().__init__(buffer_size, observation_space, action_space, device, 1, **options)
        self._newest: list[int | None] = [None] * n_envs
        self.chunk_rows = max(1, CHUNK_BYTES // sum(array[:1].nbytes for array in self.rows().values()))
        self.changed: set[int] = set()

    @property
    def positions(self) -> Positions:
        """The write positions of the buffer; set this property to restore them."""
        return Positions(self.pos, self.full, tuple(self._newest))

    @positions.setter
    def positions(self, positions: Positions) -> None:
        self.pos, self.full, newest, _ = positions
        self._newest = list(newest)

    def can_sample(self) -> bool:
        """Return whether the buffer has a row to learn from."""
        return self.size() > 0

    def add(
        self,
        obs: Any,
        next_obs: Any,
        action: np.ndarray,
        reward: np.ndarray,
        done: np.ndarray,
        infos: list[dict[str, Any]],
    ) -> None:
        """Append the valid rows of a step; before an invalid row, mark the member's last row as truncated."""
        for row, info in enumerate(infos):
            if is_valid(info):
                one = slice(row, row + 1)
                # In a full buffer, this row may overwrite the newest row of another member.
                self._newest = [None if newest == self.pos else newest for newest in self._newest]
                self._newest[row] = self.pos
                self.changed.add(self.pos // self.chunk_rows)
                super().add(part(obs, one), part(next_obs, one), action[one], reward[one], done[one], [info])
            elif not is_pending(info):
                self._truncate(self._newest[row])

    def rows(self, start: int = 0, stop: int | None = None) -> dict[str, np.ndarray]:
        """Return the rows from `start` to `stop` by column, as views of shape (rows, 1, ...)."""
        return {name: column[start:stop] for name, column in self._columns().items()}

    def fill(self, start: int, rows: Mapping[str, np.ndarray]) -> None:
        """Restore rows that `rows` returned, from row `start` on; the write positions do not change.

        Raises:
            ValueError: the rows have another shape.
        """
        for name, column in self._columns().items():
            column[start : start + len(rows[name])] = rows[name]

    def keep(self, kept: np.ndarray) -> None:
        """Keep only the rows that the mask `kept` selects, and move them to the start, oldest first."""
        order = np.roll(np.arange(self.size()), -self.pos if self.full else 0)
        order = order[kept[order]]
        self.fill(0, {name: column[order] for name, column in self.rows().items()})
        self.pos, self.full = len(order) % self.buffer_size, len(order) == self.buffer_size
        self._newest = [None] * len(self._newest)
        self.changed = set(range(-(-self.size() // self.chunk_rows)))

    def _columns(self) -> dict[str, np.ndarray]:
        """Return all columns by name, in the order of `COLUMNS`; each key of a Dict has its own column."""
        columns: dict[str, np.ndarray] = {}
        for name in COLUMNS:
            columns |= by_name(getattr(self, name), name)
        return columns

    def _truncate(self, position: int | None) -> None:
        if position is not None and not self.dones[position]:
            self.dones[position] = 1.0
            self.timeouts[position] = 1.0
            self.changed.add(position // self.chunk_rows)


class ValidDictReplayBuffer(ValidReplayBuffer, DictReplayBuffer):
    """A replay buffer of valid rows for observations that are a Dict."""


class ValidRolloutBuffer(RolloutBuffer):
    """A rollout buffer in which invalid rows keep their positions and are never sampled."""

    valid: np.ndarray

    def reset(self) -> None:
        """Empty the buffer; every row counts as valid until `mark` sets its mask."""
        self.valid = np.ones((self.buffer_size, self.n_envs), dtype=bool)
        super().reset()

    def mark(self, valid: np.ndarray) -> None:
        """Set the mask of valid rows for the step that `add` stores next; shape (n_envs,)."""
        if self.pos < self.buffer_size:
            self.valid[self.pos] = valid

    def compute_returns_and_advantage(self, last_values: torch.Tensor, dones: np.ndarray) -> None:
        """Compute returns and advantages as if the rollout was truncated before each invalid row.

        An invalid row ends its episode. Its reward is set to its value estimate, so its advantage is 0. The
        row before the invalid row then bootstraps from the value of the state between the two rows.
        """
        self.rewards[~self.valid] = self.values[~self.valid]
        super().compute_returns_and_advantage(last_values, dones)

    def get(self, batch_size: int | None = None) -> Generator[Any, None, None]:
        """Yield minibatches of valid rows in random order."""
        if not self.generator_ready:
            next(super().get(1))  # this call flattens the rows of all members into one column
        rows = np.random.permutation(np.flatnonzero(self.swap_and_flatten(self.valid)))
        for batch in self._parts(rows, batch_size or max(len(rows), 1)):
            yield self._get_samples(batch)

    def _parts(self, rows: np.ndarray, size: int) -> Iterator[np.ndarray]:
        """Yield `rows` in parts of `size`; the last part may be smaller."""
        return (rows[start : start + size] for start in range(0, len(rows), size))


class ValidDictRolloutBuffer(ValidRolloutBuffer, DictRolloutBuffer):
    """A rollout buffer with invalid rows for observations that are a Dict."""


def batches(rows: np.ndarray, size: int) -> Iterator[np.ndarray]:
    """Yield `rows` in parts of `size`; add a single last row to the part before it.

    A part with a single row would have one advantage, whose standard deviation is NaN.
    """
    for start in range(0, max(len(rows) - 1, 1), size):
        is_last = start + size >= len(rows) - 1
        yield rows[start:] if is_last else rows[start : start + size]
