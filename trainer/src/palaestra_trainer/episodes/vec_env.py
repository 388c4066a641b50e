"""A Stable-Baselines3 VecEnv of many simulators that tolerates their faults.

All members step at the same time: the caller's thread sends a step to every simulator before it waits for the
first response. A faulty member is restarted in the background, while the other members continue. The rows of
the faulty member are invalid until it is up again, see `palaestra_trainer.episodes.collector`. The thread
waits for a restart only if no member can step.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import structlog
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvObs, VecEnvStepReturn

from palaestra_protocol.pod.status import Cause
from palaestra_protocol.scene import SceneState
from palaestra_trainer.environments.copies import copied
from palaestra_trainer.environments.infos import is_valid
from palaestra_trainer.environments.masks import ACTION_MASKS, gives_masks
from palaestra_trainer.episodes.collecting import CollectingVecEnv
from palaestra_trainer.episodes.collector import CollectedRow, Collector
from palaestra_trainer.episodes.episode_state import EpisodeState
from palaestra_trainer.errors import fact_of
from palaestra_trainer.simulators.base_vec_env import MembersVecEnv
from palaestra_trainer.simulators.interface import Environment
from palaestra_trainer.simulators.restarter import Restarter, await_one, settle
from palaestra_trainer.waiting.check import Check, go_on
from palaestra_trainer.waiting.greenlets import take_turns

log = structlog.get_logger(__name__)

COMPUTE_REWARD = "compute_reward"  # the method of goal environments


class SimulatorsVecEnv(MembersVecEnv, CollectingVecEnv):
    """The collecting simulators of a run, for Stable-Baselines3.

    Args:
        restarters: the restarter of each member; rows have the same order.
        run_seed: the replica's seed; the seed of each episode is derived from this seed.
        check: called every tenth of a second during waits for members; it raises to end the wait.
        judge: an environment that computes the rewards of goals and needs no simulator; None: the members'
            environments compute these rewards.
    """

    def __init__(
        self,
        restarters: Sequence[Restarter],
        run_seed: int,
        *,
        check: Check = go_on,
        judge: Environment | None = None,
    ) -> None:
        super().__init__(restarters)
        self._check = check
        self._judge = judge
        self._collectors = [
            Collector(restarter, run_seed, index, check) for index, restarter in enumerate(restarters)
        ]
        self._watcher = restarters[0].watcher
        self._seeds = [None] * self.num_envs
        self._gives_masks = all(gives_masks(restarter.member.env) for restarter in restarters)

    def pause(self) -> None:
        """Pause all members until `unpause`."""
        for restarter in self._restarters:
            restarter.pause()

    def unpause(self) -> None:
        """End the pause of all members."""
        for restarter in self._restarters:
            restarter.unpause()

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Set the run's seed, unless `seed` is None; return the seeds of the next episodes."""
        for collector in self._collectors:
            collector.run_seed = collector.run_seed if seed is None else seed
        return [collector.next_seed() for collector in self._collectors]

    def reset(self) -> VecEnvObs:
        """Begin new episodes in all members at the same time; return their first observations."""
        with self._watcher.spending(Cause.TRANSPORT):
            observations = take_turns(
                partial(collector.begin, options or None)
                for collector, options in zip(self._collectors, self._options, strict=True)
            )
        self._reset_options()
        self._keep_reset_infos()
        return self._stack(observations)

    def set_training_progress(self, training_progress: float) -> None:
        """Set the share of the training that is complete when the next episodes begin, 0 to 1."""
        for collector in self._collectors:
            collector.training_progress = training_progress

    def snapshot(self) -> list[EpisodeState]:
        """Return the position of each member in its episodes; later steps do not change the result."""
        return [collector.state for collector in self._collectors]

    def moments(self) -> dict[str, SceneState]:
        """Return the episode and step of each member by name; any thread may call this method."""
        return {collector.restarter.name: collector.moment for collector in self._collectors}

    def resume(self, states: Sequence[EpisodeState], *, masked: bool = False) -> VecEnvObs:
        """Bring all members back to their states at the same time; return their observations.

        The repeated steps are not counted. Returns and lengths of the episodes continue from their old
        values. If `masked` is set, a member does not take an action that its mask forbids now.
        """
        observations = take_turns(
            partial(collector.resume, state, masked=masked)
            for collector, state in zip(self._collectors, states, strict=True)
        )
        self._keep_reset_infos()
        return self._stack(observations)

    def step_wait(self) -> VecEnvStepReturn:
        """Step all members at the same time; return observations, rewards, dones and infos.

        Raises:
            FaultBudgetSpent: a member failed more often than its restart budget allows.
            Diverged: an environment's observation or reward is not finite.
        """
        self._await_somebody()
        with self._watcher.spending(Cause.TRANSPORT):
            rows = self._rows()
        if valid := sum(is_valid(row.info) for row in rows):
            self._watcher.stepped(valid)
        dones = [row.done for row in rows]
        if any(dones):
            self._keep_reset_infos()
        return (
            self._stack([row.observation for row in rows]),
            np.array([row.reward for row in rows], dtype=np.float32),
            np.array(dones),
            [row.info for row in rows],
        )

    def close(self) -> None:
        """End restarts in the background and close the environments; the caller stops the simulators.

        If an environment raises an error, the error is logged, and the other environments are closed too.
        """
        settle(self._restarters)
        for restarter in self._restarters:
            if not restarter.busy:
                _close(restarter)

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Return the result of a method of each chosen environment.

        `compute_reward` is called on the judge, because members may be restarting. The judge gets copies,
        because the learner uses the goals later. `action_masks` is not called on a member that restarts or is
        lost.
        """
        if method_name == ACTION_MASKS and self._gives_masks:
            return self._action_masks(indices)
        if self._judge is None or method_name != COMPUTE_REWARD:
            return super().env_method(method_name, *method_args, indices=indices, **method_kwargs)
        return [self._judge.get_wrapper_attr(method_name)(*copied(method_args), **copied(method_kwargs))]

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return an attribute of each chosen environment; for `action_masks`, its collector's method."""
        if attr_name == ACTION_MASKS and self._gives_masks:
            return [self._collectors[index].action_mask for index in self._get_indices(indices)]
        return super().get_attr(attr_name, indices)

    def _rows(self) -> list[CollectedRow]:
        """Step all members and return their rows; called by `step_wait`."""
        return take_turns(
            partial(collector.step, action)
            for collector, action in zip(self._collectors, self._actions, strict=True)
        )

    def _action_masks(self, indices: VecEnvIndices) -> list[Any]:
        with self._watcher.spending(Cause.TRANSPORT):
            return take_turns(self._collectors[index].action_mask for index in self._get_indices(indices))

    def _await_somebody(self) -> None:
        """If no member can step, wait until a member is restarted, because all rows would be invalid."""
        if all(restarter.busy or restarter.lost for restarter in self._restarters):
            with self._watcher.spending(Cause.RECOVERING):
                await_one(self._restarters, self._check)

    def _keep_reset_infos(self) -> None:
        self.reset_infos = [collector.reset_info for collector in self._collectors]


def _close(restarter: Restarter) -> None:
    try:
        restarter.member.env.close()
    except (Exception, SystemExit) as error:  # code of the job's author may raise anything
        log.warning("environment not closed", simulator=restarter.name, fact=fact_of(error), exc_info=error)
