"""A gymnasium VectorEnv that tolerates faults of its members' simulators."""

from __future__ import annotations

import operator
from collections.abc import Sequence
from typing import Any, SupportsIndex

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space, concatenate, create_empty_array, iterate

from palaestra_trainer.run.fault_tolerant.env_group import EnvGroup

Seeds = SupportsIndex | Sequence[int | None] | None
Stepped = tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]


class FaultTolerantVectorEnv(VectorEnv[Any, Any, np.ndarray]):
    """A VectorEnv whose members step at the same time; the last step of an episode also resets the member.

    The last observation and info of an episode are `infos["final_obs"]` and `infos["final_info"]`. If a fault
    ended the episode, `infos["final_info"]["palaestra"]["sim_fault"]` is set. The step then waits until the
    faulty simulator is restarted. The other simulators wait too, because this interface needs a row from
    every simulator.

    Args:
        players: the members, in the order of the rows.
    """

    def __init__(self, players: EnvGroup) -> None:
        self._players = players
        self.num_envs = len(players.all)
        inner = players.all[0].env
        self.metadata = {**inner.metadata, "autoreset_mode": AutoresetMode.SAME_STEP}
        self.render_mode = inner.render_mode
        self.single_observation_space, self.single_action_space = inner.observation_space, inner.action_space
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)

    def reset(
        self, *, seed: Seeds = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode in every member at the same time; return the first observations and infos.

        Args:
            seed: seed of the first member; the second member gets `seed + 1`, and so on. A list has a seed
                for each member.
            options: options of the environment's reset, the same for each member.

        Raises:
            ValueError: the numbers of seeds and members differ.
            The same errors as `EnvGroup.begin`.
        """
        self._players.begin(self._seeds(seed), [options] * self.num_envs)
        infos: dict[str, Any] = {}
        for index, player in enumerate(self._players.all):
            infos = self._add_info(infos, player.reset_info, index)
        return self._stacked(), infos

    def step(self, actions: Any) -> Stepped:
        """Step all members at the same time; return the five results of a step, one row per member.

        Raises:
            The same errors as `EnvGroup.step_all`.
        """
        rows = self._players.step_all(list(iterate(self.action_space, actions)))
        infos: dict[str, Any] = {}
        for index, (player, row) in enumerate(zip(self._players.all, rows, strict=True)):
            final = {"final_obs": row.step[0], "final_info": row.info}
            infos = self._add_info(infos, final | player.reset_info if row.ended else row.info, index)
        _, rewards, terminations, truncations, _ = zip(*(row.step for row in rows), strict=True)
        return (
            self._stacked(),
            np.array(rewards, np.float64),
            np.array(terminations, np.bool_),
            np.array(truncations, np.bool_),
            infos,
        )

    def call(self, name: str, *arguments: Any, **options: Any) -> tuple[Any, ...]:
        """Return the result of a method, or an attribute, of each environment, as `SyncVectorEnv` does."""
        found = [player.env.get_wrapper_attr(name) for player in self._players.all]
        return tuple(each(*arguments, **options) if callable(each) else each for each in found)

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """Return an attribute of each environment, even if an inner wrapper defines it."""
        return self.call(name)

    def set_attr(self, name: str, values: Any) -> None:
        """Set an attribute of each environment; `values` is one value for all, or a list or tuple of values.

        Raises:
            ValueError: the numbers of values and environments differ.
        """
        each = values if isinstance(values, list | tuple) else [values] * self.num_envs
        if len(each) != self.num_envs:
            raise ValueError(
                f"values: {len(each)} values for {self.num_envs} environments; give one for each"
            )
        for player, value in zip(self._players.all, each, strict=True):
            player.restarter.set_attribute(name, value)

    def render(self) -> tuple[Any, ...]:
        """Return the result of each environment's `render`."""
        return self.call("render")

    def close_extras(self, **kwargs: Any) -> None:
        """Stop the simulators and release them."""
        del kwargs
        self._players.close()

    def _seeds(self, seed: Seeds) -> Sequence[int | None]:
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, SupportsIndex):
            return [operator.index(seed) + index for index in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise ValueError(f"seed: {len(seed)} seeds for {self.num_envs} environments; give one for each")
        return seed

    def _stacked(self) -> Any:
        space = self.single_observation_space
        empty = create_empty_array(space, self.num_envs, fn=np.zeros)
        return concatenate(space, [player.observation for player in self._players.all], empty)
