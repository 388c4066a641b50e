"""Compute the size of a replay buffer from the spaces, before the buffer exists.

The memory of a NumPy array is allocated page by page when rows are first written. So a buffer with more rows
than the run has steps needs memory only for the rows of these steps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from gymnasium import spaces
from stable_baselines3.common.preprocessing import get_action_dim, get_obs_shape

from palaestra_trainer.algorithms import her
from palaestra_trainer.environments.space_flaws import KINDS
from palaestra_trainer.job.configuration import Algorithm

_FLOAT = np.dtype(np.float32).itemsize
_REWARD_DONE_TIMEOUT = 3 * _FLOAT
# With hindsight experience replay, each row also stores the start and the length of its episode.
_EPISODE = 2 * np.dtype(np.int64).itemsize


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplaySize:
    """The size of a replay buffer.

    Attributes:
        rows: number of rows that the run can fill: the smaller of `buffer_size` and the steps of the run.
        row_bytes: size of one row: observation, next observation, action, reward, end and time limit.
    """

    rows: int
    row_bytes: int

    @property
    def memory_bytes(self) -> int:
        """The memory that all rows need."""
        return self.rows * self.row_bytes

    def disk_bytes(self, every_steps: int, keep: int) -> int:
        """Return the size of all checkpoints together; checkpoints share the rows that did not change.

        Each checkpoint except the newest has its own copy of the rows that were overwritten before the next
        checkpoint. While a new checkpoint is written, `keep` + 1 checkpoints exist.
        """
        return self.memory_bytes + keep * min(every_steps, self.rows) * self.row_bytes

    def most_rows(self, memory_bytes: int, disk_bytes: int, every_steps: int, keep: int) -> int:
        """Return the largest number of rows for which memory and the disk for checkpoints suffice."""
        in_memory = memory_bytes // self.row_bytes
        on_disk = disk_bytes // self.row_bytes
        # If the buffer has at most `every_steps` rows, two checkpoints may have no row in common. If it has
        # more rows, each checkpoint except the newest has its own copy of `every_steps` rows.
        fitting = on_disk - keep * every_steps
        return max(0, min(in_memory, fitting if fitting >= every_steps else on_disk // (keep + 1)))


def replay_size(
    algorithm: Algorithm, observation: spaces.Space[Any], action: spaces.Space[Any], steps: int
) -> ReplaySize | None:
    """Return the size of the replay buffer; None: the algorithm has no buffer, or no policy for the space.

    Args:
        algorithm: the algorithm with all its hyperparameters.
        observation: the environment's observation space.
        action: the environment's action space.
        steps: steps of the whole run.
    """
    buffer_size = algorithm.hyperparameters.get("buffer_size")
    parts = observation.spaces.values() if isinstance(observation, spaces.Dict) else [observation]
    if buffer_size is None or not all(isinstance(part, KINDS) for part in parts):
        return None
    seen = sum(math.prod(cast("tuple[int, ...]", get_obs_shape(part))) * _itemsize(part) for part in parts)
    # Stable-Baselines3 stores actions of float64 as float32.
    acted = get_action_dim(action) * min(_itemsize(action), _FLOAT if _is_float(action) else math.inf)
    episode = _EPISODE if her.wanted(algorithm) else 0
    row_bytes = int(2 * seen + acted) + _REWARD_DONE_TIMEOUT + episode
    return ReplaySize(rows=min(buffer_size, steps), row_bytes=row_bytes)


def _itemsize(space: spaces.Space[Any]) -> int:
    return np.dtype(space.dtype).itemsize


def _is_float(space: spaces.Space[Any]) -> bool:
    return np.issubdtype(np.dtype(space.dtype), np.floating)
