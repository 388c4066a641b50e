"""A Stable-Baselines3 VecEnv that tolerates faults of its members' simulators."""

from __future__ import annotations

from typing import Any

import numpy as np
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from palaestra_trainer.environments.infos import TRUNCATED
from palaestra_trainer.environments.space_flaws import refuse_flaws
from palaestra_trainer.run.fault_tolerant.env_group import EnvGroup
from palaestra_trainer.run.fault_tolerant.episode_runner import StepResult
from palaestra_trainer.simulators.base_vec_env import MembersVecEnv


class FaultTolerantVecEnv(MembersVecEnv):
    """A VecEnv whose members all step at the same time, as in `FaultTolerantVectorEnv`.

    The info of an episode's last step has `terminal_observation`, `TimeLimit.truncated`, and `episode` as
    Stable-Baselines3's Monitor sets it. If a fault truncated the episode, the info has `sim_fault`
    (`palaestra_trainer.environments.infos`) but not `episode`. So `rollout/ep_rew_mean` does not count that
    episode.

    Args:
        players: the members, in the order of the rows.

    Raises:
        ConfigurationError: Stable-Baselines3 would misinterpret the environment's observations or actions.
    """

    def __init__(self, players: EnvGroup) -> None:
        self._players = players
        task = players.all[0].env
        refuse_flaws(task.observation_space, task.action_space)
        super().__init__([player.restarter for player in players.all])

    def reset(self) -> VecEnvObs:
        """Begin an episode in every member at the same time; return the first observations.

        Raises:
            The same errors as `EnvGroup.begin`.
        """
        self._players.begin(self._seeds, [options or None for options in self._options])
        self._reset_seeds()
        self._reset_options()
        return self._seen()

    def step_wait(self) -> VecEnvStepReturn:
        """Step all members at the same time; return observations, rewards, dones and infos.

        Raises:
            The same errors as `EnvGroup.step_all`.
        """
        rows = self._players.step_all(list(self._actions))
        return (
            self._seen(),
            np.array([row.step[1] for row in rows], np.float32),
            np.array([row.ended for row in rows], np.bool_),
            [_info(row) for row in rows],
        )

    def close(self) -> None:
        """Stop the simulators and release them; further calls have no effect."""
        self._players.close()

    def _seen(self) -> VecEnvObs:
        self.reset_infos = [player.reset_info for player in self._players.all]
        return self._stack([player.observation for player in self._players.all])


def _info(row: StepResult) -> dict[str, Any]:
    observation, _, terminated, truncated, _ = row.step
    limited = row.marked | {TRUNCATED: truncated and not terminated}
    if not row.ended:
        return limited
    ended = {**limited, "terminal_observation": observation}
    return ended if row.episode is None else {**ended, "episode": row.episode}
