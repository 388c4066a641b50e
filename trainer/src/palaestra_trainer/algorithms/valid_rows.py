"""Subclasses of Stable-Baselines3 algorithms that count only valid rows and learn only from them.

Two mixins override methods that Stable-Baselines3 calls between a step and the storage of its rows, so this
module copies no code. `with_valid_rows` returns a subclass of an algorithm with one of the mixins. A saved
model names neither that subclass nor the buffers, so the original class can load the model.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from typing import Any, cast

import numpy as np
from gymnasium import spaces
from sb3_contrib import MaskablePPO
from sb3_contrib.common.maskable.buffers import MaskableDictRolloutBuffer, MaskableRolloutBuffer
from sb3_contrib.common.recurrent.buffers import RecurrentDictRolloutBuffer, RecurrentRolloutBuffer
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.buffers import ReplayBuffer, RolloutBuffer
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm
from stable_baselines3.common.type_aliases import RolloutReturn, TrainFreq, TrainFrequencyUnit
from stable_baselines3.common.utils import explained_variance

from palaestra_trainer.algorithms import own_buffers
from palaestra_trainer.algorithms.begun_actions import BegunActions
from palaestra_trainer.algorithms.buffers import (
    ValidDictReplayBuffer,
    ValidReplayBuffer,
    ValidRolloutBuffer,
    valid_rows,
)
from palaestra_trainer.algorithms.recurrent import (
    ValidRecurrentDictRolloutBuffer,
    ValidRecurrentRolloutBuffer,
)
from palaestra_trainer.algorithms.reinforce import REINFORCE
from palaestra_trainer.errors import ConfigurationError

# Each rollout buffer on the left is replaced by the class on its right. An algorithm that creates a buffer of
# another class is refused, because the replacement would not store what that class adds.
_MASKED: Mapping[type[RolloutBuffer], type[Any]] = {
    **own_buffers.VALID_ROLLOUTS,
    RecurrentRolloutBuffer: ValidRecurrentRolloutBuffer,
    RecurrentDictRolloutBuffer: ValidRecurrentDictRolloutBuffer,
}
# Only MaskablePPO and its subclasses may use these buffers, because evaluations and exported policies pass
# masks to no other algorithm.
_WITH_MASKS = (MaskableRolloutBuffer, MaskableDictRolloutBuffer)
_BUFFERS = ("replay_buffer_class", "replay_buffer_kwargs", "rollout_buffer_class", "rollout_buffer_kwargs")


class ValidRowsCounted(BaseAlgorithm):
    """An algorithm that counts only valid rows as steps."""

    def _update_info_buffer(self, infos: list[dict[str, Any]], dones: np.ndarray | None = None) -> None:
        valid = valid_rows(infos)
        self.num_timesteps -= int(len(valid) - valid.sum())
        super()._update_info_buffer(infos, dones)

    def _excluded_save_params(self) -> list[str]:
        return [*super()._excluded_save_params(), *_BUFFERS, "_begun", "_counted_at"]


class _PartOfRollout(BaseCallback):
    """Joins rollouts of one vector step to one rollout of another callback, which only its caller ends.

    Otherwise the run would pause its simulators for an update after each vector step.
    """

    def __init__(self, callback: BaseCallback) -> None:
        super().__init__()
        self._callback = callback
        self._begun = False

    def on_rollout_start(self) -> None:
        """Begin the rollout at its first vector step."""
        if not self._begun:
            self._begun = True
            self._callback.on_rollout_start()

    def on_step(self) -> bool:
        """Return whether the other callback continues the training."""
        return self._callback.on_step()

    def on_rollout_end(self) -> None:
        """Do nothing, because further vector steps may follow."""

    def update_locals(self, locals_: dict[str, Any]) -> None:
        """Pass the local variables of the collection to the other callback."""
        self._callback.update_locals(locals_)

    def _on_step(self) -> bool:
        return True


class OffPolicyRows(ValidRowsCounted, OffPolicyAlgorithm):
    """An off-policy algorithm that stores only valid rows, and stops at the run's number of steps.

    Raises:
        ConfigurationError: the algorithm creates its own replay buffer, which would store invalid rows.
    """

    def _setup_model(self) -> None:
        self._begun, self._counted_at = BegunActions(), 0
        as_dict = isinstance(self.observation_space, spaces.Dict)
        chosen = self.replay_buffer_class or (ValidDictReplayBuffer if as_dict else ValidReplayBuffer)
        self.replay_buffer_class = own_buffers.of_valid_rows(chosen)
        super()._setup_model()
        if not isinstance(self.replay_buffer, ValidReplayBuffer):
            raise _creates_its_own(self, self.replay_buffer)

    def collect_rollouts(
        self, env: Any, callback: BaseCallback, train_freq: TrainFreq, *args: Any, **kwargs: Any
    ) -> RolloutReturn:
        """Collect the steps of `train_freq`, but stop at the run's number of steps."""
        if _is_asynchronous(env) and train_freq.unit is TrainFrequencyUnit.STEP:
            return self._collect_rows(train_freq.frequency * env.num_envs, env, callback, *args, **kwargs)
        if train_freq.unit is TrainFrequencyUnit.STEP:
            missing = math.ceil((self._total_timesteps - self.num_timesteps) / env.num_envs)
            train_freq = train_freq._replace(frequency=max(1, min(train_freq.frequency, missing)))
        return super().collect_rollouts(env, callback, train_freq, *args, **kwargs)

    def _collect_rows(
        self, count: int, env: Any, callback: BaseCallback, *args: Any, **kwargs: Any
    ) -> RolloutReturn:
        """Collect `count` valid rows; a vector step of an asynchronous environment may have only one."""
        before, episodes = self.num_timesteps, 0
        wanted = min(before + count, self._total_timesteps)
        part_of_rollout = _PartOfRollout(callback)
        goes_on = True
        while goes_on and self.num_timesteps < wanted:
            one = TrainFreq(1, TrainFrequencyUnit.STEP)
            rollout = super().collect_rollouts(env, part_of_rollout, one, *args, **kwargs)
            episodes += rollout.n_episodes
            goes_on = rollout.continue_training
        if goes_on:
            callback.on_rollout_end()
        return RolloutReturn(self.num_timesteps - before, episodes, goes_on)

    def _store_transition(
        self,
        replay_buffer: ReplayBuffer,
        buffer_action: np.ndarray,
        new_obs: np.ndarray | dict[str, np.ndarray],
        reward: np.ndarray,
        dones: np.ndarray,
        infos: list[dict[str, Any]],
    ) -> None:
        taken = self._begun.taken(buffer_action, infos)
        super()._store_transition(replay_buffer, taken, new_obs, reward, dones, infos)

    def _on_step(self) -> None:
        """Count a vector step, for example for the target network.

        In an asynchronous environment, `n_envs` valid rows count as one vector step.
        """
        if not _is_asynchronous(self.env):
            super()._on_step()
        elif abs(self.num_timesteps - self._counted_at) >= self.n_envs:  # a resume may lower the count
            self._counted_at = self.num_timesteps
            super()._on_step()

    def train(self, gradient_steps: int, batch_size: int = 100) -> None:
        """Learn from the replay buffer; do nothing while the buffer has no rows to sample."""
        if cast("ValidReplayBuffer", self.replay_buffer).can_sample():
            super().train(gradient_steps=gradient_steps, batch_size=batch_size)


class OnPolicyRows(ValidRowsCounted, OnPolicyAlgorithm):
    """An on-policy algorithm whose rollout buffer never samples invalid rows.

    Raises:
        ConfigurationError: the algorithm creates its own rollout buffer, which would sample invalid rows.
    """

    def _masked(self) -> ValidRolloutBuffer:
        return cast("ValidRolloutBuffer", self.rollout_buffer)  # set in _setup_model

    def _setup_model(self) -> None:
        if chosen := self.rollout_buffer_class:
            self.rollout_buffer_class = own_buffers.of_valid_rows(chosen)
        super()._setup_model()
        theirs = self.rollout_buffer
        if isinstance(theirs, own_buffers.OwnBuffer):
            self._refuse_masks(theirs)
            return
        masked = _MASKED.get(type(theirs))
        if masked is None or (isinstance(theirs, _WITH_MASKS) and not isinstance(self, MaskablePPO)):
            raise _creates_its_own(self, theirs)
        sequences = {name: getattr(theirs, name) for name in ("hidden_state_shape",) if hasattr(theirs, name)}
        self.rollout_buffer = masked(
            theirs.buffer_size,
            self.observation_space,
            self.action_space,
            device=self.device,
            gae_lambda=theirs.gae_lambda,
            gamma=theirs.gamma,
            n_envs=theirs.n_envs,
            **sequences,
        )

    def _refuse_masks(self, buffer: RolloutBuffer) -> None:
        """Refuse a buffer with masks for an algorithm without masks, or without masks for MaskablePPO."""
        takes_masks = isinstance(self, MaskablePPO)
        if isinstance(buffer, _WITH_MASKS) == takes_masks:
            return
        masks, base = ("needs", "MaskableRolloutBuffer") if takes_masks else ("has no", "RolloutBuffer")
        raise ConfigurationError(
            f"{own_buffers.field_of(type(buffer))}: {type(buffer).__name__} does not fit "
            f"{type(self).__name__}, which {masks} action masks; extend {base}"
        )

    def _update_info_buffer(self, infos: list[dict[str, Any]], dones: np.ndarray | None = None) -> None:
        super()._update_info_buffer(infos, dones)
        self._masked().mark(valid_rows(infos))

    def train(self) -> None:
        """Learn from the rollout, unless too few of its rows are valid.

        With `normalize_advantage`, a single valid row is too few, because the deviation of a single advantage
        is NaN.
        """
        rollout = self._masked()
        if rollout.valid.sum() < (2 if getattr(self, "normalize_advantage", False) else 1):
            return
        super().train()
        valid = rollout.swap_and_flatten(rollout.valid).flatten()
        explained = explained_variance(rollout.values.flatten()[valid], rollout.returns.flatten()[valid])
        self.logger.record("train/explained_variance", explained)


def refuse_asynchronous(model: BaseAlgorithm) -> None:
    """Check that the model of an asynchronous environment learns from single rows, which come in any order.

    Raises:
        ConfigurationError: the model learns from rollouts, which need a row of every simulator in each step.
    """
    if _is_asynchronous(model.env) and not isinstance(model, OffPolicyRows):
        raise ConfigurationError(
            "collection: Asynchronous needs an off-policy algorithm, such as DQN or SAC, and "
            f"{type(model).__name__} learns from rollouts; remove the field, or use another algorithm"
        )


def _is_asynchronous(env: Any) -> bool:
    return bool(getattr(env.unwrapped, "asynchronous", False))


@cache
def with_valid_rows(cls: type[BaseAlgorithm]) -> type[BaseAlgorithm]:
    """Return a subclass of the same name that counts only valid rows and learns only from valid rows.

    Raises:
        ConfigurationError: `cls` is neither an on-policy nor an off-policy algorithm of Stable-Baselines3.
    """
    if issubclass(cls, REINFORCE):
        return cls
    if issubclass(cls, OffPolicyAlgorithm):
        rows: type[BaseAlgorithm] = OffPolicyRows
    elif issubclass(cls, OnPolicyAlgorithm):
        rows = OnPolicyRows
    else:
        raise ConfigurationError(
            f"algorithm.name: {cls.__name__} is neither an OnPolicyAlgorithm nor an OffPolicyAlgorithm, so "
            "it would learn from rows that a fault made invalid; use a subclass of one of them"
        )
    made = type(cls.__name__, (rows, cls), {"__doc__": cls.__doc__, "__module__": cls.__module__})
    return cast("type[BaseAlgorithm]", made)


def _creates_its_own(model: BaseAlgorithm, buffer: Any) -> ConfigurationError:
    return ConfigurationError(
        f"algorithm.name: {type(model).__name__} creates its own {type(buffer).__name__}, which would keep "
        "rows that a fault made invalid; use an algorithm with a buffer of Stable-Baselines3"
    )
