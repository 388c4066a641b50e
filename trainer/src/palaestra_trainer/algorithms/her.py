"""Hindsight experience replay, which learns from goals that an episode reached by accident.

A job chooses this method by two hyperparameters of Stable-Baselines3 and rl-baselines3-zoo:
`replay_buffer_class` and `replay_buffer_kwargs`. New goals are drawn from whole episodes. So each member has
its own column and write position. A fault closes the member's episode at its last valid row. Source of the
method: Andrychowicz et al. (2017), https://arxiv.org/abs/1707.01495
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import structlog
import torch
from gymnasium import spaces
from stable_baselines3.her import HerReplayBuffer

from palaestra_trainer.algorithms.buffers import (
    CHUNK_BYTES,
    Positions,
    ValidDictReplayBuffer,
)
from palaestra_trainer.environments.infos import is_pending, is_valid
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Algorithm, nearest

log = structlog.get_logger(__name__)

NAME = "HerReplayBuffer"
STRATEGIES = ("future", "final", "episode")
OPTIONS = ("n_sampled_goal", "goal_selection_strategy")
GOALS = ("achieved_goal", "desired_goal")
_EPISODES = ("ep_start", "ep_length")


def wanted(algorithm: Algorithm) -> bool:
    """Return whether a job chooses hindsight experience replay."""
    return algorithm.hyperparameters.get("replay_buffer_class") == NAME


def mistakes(options: Mapping[str, Any], field: str) -> Iterator[str]:
    """Yield a message with field, fact and remedy for each wrong option of the buffer."""
    for name, value in options.items():
        if name not in OPTIONS:
            yield f"{field}.{name}: is not an option of this buffer; {nearest(str(name), list(OPTIONS))}"
        elif name == OPTIONS[0] and not _is_count(value):
            yield f"{field}.{name}: {value!r} is refused; give a whole number above 0"
        elif name == OPTIONS[1] and value not in STRATEGIES:
            yield f"{field}.{name}: {value!r} is refused; use {', '.join(STRATEGIES)}"


def refuse_other_observations(observation: spaces.Space[Any]) -> None:
    """Check that an observation holds an achieved and a desired goal.

    Raises:
        ConfigurationError: the observation is not a Dict with the keys of a goal environment, or the two
            goals have different shapes.
    """
    parts = observation.spaces if isinstance(observation, spaces.Dict) else {}
    if not parts.keys() >= {"observation", *GOALS}:
        raise ConfigurationError(
            f"environment.id: {NAME} needs an observation that is a Dict with observation, achieved_goal and "
            "desired_goal; use such an environment, or remove replay_buffer_class"
        )
    if parts[GOALS[0]].shape != parts[GOALS[1]].shape:
        raise ConfigurationError(
            f"environment.id: its achieved_goal has the shape {parts[GOALS[0]].shape} and its desired_goal "
            f"{parts[GOALS[1]].shape}; give both the same shape"
        )


class ValidHerReplayBuffer(ValidDictReplayBuffer, HerReplayBuffer):
    """A buffer for hindsight experience replay that stores valid rows, with a column for each member.

    Only rows of closed episodes are sampled. Of an episode that is longer than its column, only the last rows
    are kept.
    """

    def __init__(
        self,
        buffer_size: int,
        observation_space: spaces.Dict,
        action_space: spaces.Space[Any],
        env: Any,
        device: torch.device | str = "auto",
        n_envs: int = 1,
        **options: Any,
    ) -> None:
        HerReplayBuffer.__init__(
            self, buffer_size, observation_space, action_space, env, device=device, n_envs=n_envs, **options
        )
        # Infos are not stored, because checkpoints would have to pickle them. So `compute_reward` does not
        # get infos.
        self.infos = np.empty((0, n_envs))
        self._next = [0] * n_envs
        self._filled = [False] * n_envs
        self._under_way = [0] * n_envs  # number of rows of the open episode
        self._waited = False
        self.chunk_rows = max(1, CHUNK_BYTES // sum(array[:1].nbytes for array in self.rows().values()))
        self.changed = set()

    @property
    def positions(self) -> Positions:
        """The write positions of the columns; `newest` holds the first row of each member's open episode."""
        starts = [self._start(column) if self._under_way[column] else None for column in range(self.n_envs)]
        columns = tuple(zip(self._next, self._filled, strict=True))
        return Positions(0, all(self._filled), tuple(starts), columns)

    @positions.setter
    def positions(self, positions: Positions) -> None:
        if len(positions.columns) != self.n_envs:
            raise ConfigurationError(
                f"simulators: {NAME} has a column for each collecting simulator; the checkpoint has "
                f"{len(positions.columns)} columns, not {self.n_envs}; use the number of simulators that it "
                "was saved with"
            )
        self._next = [row for row, _ in positions.columns]
        self._filled = [filled for _, filled in positions.columns]
        for column, start in enumerate(positions.newest):
            # `start` is None if no episode is open, or if the resumed run does not continue the open episode.
            # Such an episode is never closed, so its rows are not sampled.
            rows = 0 if start is None else (self._next[column] - start) % self.buffer_size
            self._under_way[column] = self.buffer_size if start == self._next[column] else rows
            open_rows = self._rows_under_way(column)
            # These rows are marked as a closed episode if a rollout closed it and the resume dropped that
            # rollout.
            if self.ep_length[open_rows, column].any():
                self._set_episode(open_rows, column, self._start(column), 0)

    def size(self) -> int:
        """Return the number of rows in use in the fullest column."""
        return max(map(self._used, range(self.n_envs)))

    def can_sample(self) -> bool:
        """Return whether at least one episode is closed; log the first False result."""
        ready = bool((self.ep_length > 0).any())
        if not ready and not self._waited:
            self._waited = True
            log.info("learning waits for the first whole episode", rows=self.size())
        return ready

    def add(
        self,
        obs: Any,
        next_obs: Any,
        action: np.ndarray,
        reward: np.ndarray,
        done: np.ndarray,
        infos: list[dict[str, Any]],
    ) -> None:
        """Append each valid row to its member's column; if a row is invalid, close the member's episode."""
        actions = action.reshape((self.n_envs, self.action_dim))
        for column, info in enumerate(infos):
            if not is_valid(info):
                if not is_pending(info):
                    self._cut(column)
                continue
            row = self._next[column]
            self._forget_episode_from(row, column)
            for key in self.observations:
                self.observations[key][row, column] = obs[key][column]
                self.next_observations[key][row, column] = next_obs[key][column]
            self.actions[row, column] = actions[column]
            self.rewards[row, column] = reward[column]
            self.dones[row, column] = done[column]
            self.timeouts[row, column] = info.get("TimeLimit.truncated", False)
            self._advance(column)
            if done[column]:
                self._close(column)

    def keep(self, kept: np.ndarray) -> None:
        """Drop every episode that has a row which the mask `kept` does not select."""
        for column in range(self.n_envs):
            lost = np.flatnonzero(~kept[: self._used(column)])
            for start in set(self.ep_start[lost, column].tolist()):
                self.ep_length[self.ep_start[:, column] == start, column] = 0
            self.ep_length[lost, column] = 0
            if np.isin(self._rows_under_way(column), lost).any():
                self._under_way[column] = 0
        self.changed = set(range(-(-self.size() // self.chunk_rows)))

    def _columns(self) -> dict[str, np.ndarray]:
        return super()._columns() | {name: getattr(self, name) for name in _EPISODES}

    def _used(self, column: int) -> int:
        return self.buffer_size if self._filled[column] else self._next[column]

    def _start(self, column: int) -> int:
        return (self._next[column] - self._under_way[column]) % self.buffer_size

    def _rows_under_way(self, column: int) -> np.ndarray:
        return (self._start(column) + np.arange(self._under_way[column])) % self.buffer_size

    def _advance(self, column: int) -> None:
        row = self._next[column]
        self.changed.add(row // self.chunk_rows)
        self.ep_length[row, column] = 0
        self._filled[column] = self._filled[column] or row + 1 == self.buffer_size
        self._next[column] = (row + 1) % self.buffer_size
        self._under_way[column] = min(self._under_way[column] + 1, self.buffer_size)

    def _forget_episode_from(self, row: int, column: int) -> None:
        """Exclude `row` and the later rows of its old episode from sampling, before `row` is overwritten."""
        length = int(self.ep_length[row, column])
        if length:
            rest = length - (row - int(self.ep_start[row, column])) % self.buffer_size
            self._set_episode((row + np.arange(rest)) % self.buffer_size, column, row, 0)

    def _cut(self, column: int) -> None:
        """Close the open episode at its last row, as truncated."""
        if self._under_way[column]:
            last = (self._next[column] - 1) % self.buffer_size
            self.dones[last, column] = self.timeouts[last, column] = 1.0
            self._close(column)

    def _close(self, column: int) -> None:
        rows = self._rows_under_way(column)
        self._set_episode(rows, column, int(rows[0]), len(rows))
        self._under_way[column] = 0

    def _set_episode(self, rows: np.ndarray, column: int, start: int, length: int) -> None:
        self.ep_start[rows, column] = start
        self.ep_length[rows, column] = length
        self.changed.update(np.unique(rows // self.chunk_rows).tolist())


def _is_count(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value > 0
