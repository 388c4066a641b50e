"""The base of environments that are written with arrays: one object has many copies of a task.

The class attribute `batched = True` marks such an environment; this base sets the attribute. The environment
is a `gymnasium.vector.VectorEnv` whose `reset` takes `options={"reset_mask": ...}`, as gymnasium's own vector
environments do with `AutoresetMode.DISABLED`: the caller resets the rows whose episodes have ended.

The batched form of a registered environment is its `vector_entry_point`. Each row equals the single
environment with the same seeds and actions.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.utils.seeding import np_random
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

RESET_MASK = "reset_mask"

Rows = NDArray[np.int64]
BatchedStep = tuple[Any, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]


class BatchedEnv(gymnasium.vector.VectorEnv[Any, Any, Any]):
    """Many copies of a task, whose results are arrays; row i belongs to copy i.

    A subclass implements `begin` and `step`. The info of a step is a dict of arrays with a value for each
    row, or of dicts of such arrays.

    Args:
        rows: the number of copies.
        observation_space: the space of one row's observation.
        action_space: the space of one row's action.
    """

    batched: ClassVar[bool] = True
    needs: ClassVar[tuple[type, ...]] = ()

    def __init__(
        self, rows: int, observation_space: spaces.Space[Any], action_space: spaces.Space[Any]
    ) -> None:
        self.metadata = {"autoreset_mode": AutoresetMode.DISABLED}
        self.num_envs = rows
        self.single_observation_space, self.single_action_space = observation_space, action_space
        self.observation_space = batch_space(observation_space, rows)
        self.action_space = batch_space(action_space, rows)
        self._seeds = np.zeros(rows, np.int64)

    def begin(self, rows: Rows, seeds: Sequence[int], options: dict[str, Any]) -> Any:
        """Begin an episode in rows; return the observations of all rows.

        Args:
            rows: the numbers of the rows, which increase.
            seeds: the seed of each of these rows' episodes.
            options: the options of the reset, without the mask. A run sets `training_progress` and `episode`,
                with a value for each of these rows.

        Raises:
            SimulatorFault: the simulator failed.
        """
        raise NotImplementedError

    def step(self, actions: Any) -> BatchedStep:
        """Take one step in every row; return observations, rewards, terminated, truncated and info.

        Raises:
            SimulatorFault: the simulator failed.
        """
        raise NotImplementedError

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode in the rows of `options["reset_mask"]`, or in all rows.

        Args:
            seed: the seed of row 0, with the next numbers for the other rows; or a seed for each row; None:
                each row continues with the number after its last seed.
            options: `reset_mask`, and the options of the task.
        """
        given = dict(options or {})
        mask = np.asarray(given.pop(RESET_MASK, np.ones(self.num_envs, dtype=bool)), dtype=bool)
        rows = np.flatnonzero(mask)
        if isinstance(seed, int):
            seed = list(range(seed, seed + self.num_envs))
        for row in rows.tolist():
            own = None if seed is None else seed[row]
            self._seeds[row] = self._seeds[row] + 1 if own is None else own
        return self.begin(rows, self._seeds[rows].tolist(), given), {}


def generator(seed: int) -> np.random.Generator:
    """Return the random generator that `reset(seed=seed)` gives a single environment as `np_random`."""
    random, _ = np_random(seed)
    return random
