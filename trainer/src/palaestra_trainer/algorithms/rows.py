"""Stable-Baselines3's algorithms, which count and learn from valid rows only.

Two mixins do this by overriding methods that Stable-Baselines3 calls between a
step and its storage; no code is copied. A saved model does not contain the names
of the buffers, so plain Stable-Baselines3 can load it.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import stable_baselines3 as sb3
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm
from stable_baselines3.common.type_aliases import RolloutReturn, TrainFreq, TrainFrequencyUnit
from stable_baselines3.common.utils import explained_variance

from palaestra_trainer.algorithms.buffers import ValidReplayBuffer, ValidRolloutBuffer, valid_rows

_BUFFERS = ("replay_buffer_class", "rollout_buffer_class")


class ValidRowsCounted(BaseAlgorithm):
    """Counts only valid rows as steps; an invalid row never counts as part of an episode."""

    def _update_info_buffer(self, infos: list[dict[str, Any]], dones: np.ndarray | None = None) -> None:
        valid = valid_rows(infos)
        self.num_timesteps -= int(len(valid) - valid.sum())
        super()._update_info_buffer(infos, dones)

    def _excluded_save_params(self) -> list[str]:
        return [*super()._excluded_save_params(), *_BUFFERS]


class OffPolicyRows(ValidRowsCounted, OffPolicyAlgorithm):
    """An off-policy algorithm that stores valid rows, and ends at its number of steps."""

    def _setup_model(self) -> None:
        self.replay_buffer_class = ValidReplayBuffer
        super()._setup_model()

    def collect_rollouts(
        self, env: Any, callback: BaseCallback, train_freq: TrainFreq, *args: Any, **kwargs: Any
    ) -> RolloutReturn:
        """Collect the steps of `train_freq`, but none beyond the target."""
        if train_freq.unit is TrainFrequencyUnit.STEP:
            missing = math.ceil((self._total_timesteps - self.num_timesteps) / env.num_envs)
            train_freq = train_freq._replace(frequency=max(1, min(train_freq.frequency, missing)))
        return super().collect_rollouts(env, callback, train_freq, *args, **kwargs)

    def train(self, gradient_steps: int, batch_size: int = 100) -> None:
        """Learn from the buffer, unless faults have left it empty."""
        if self.replay_buffer is not None and self.replay_buffer.size():
            super().train(gradient_steps=gradient_steps, batch_size=batch_size)


class OnPolicyRows(ValidRowsCounted, OnPolicyAlgorithm):
    """An on-policy algorithm whose rollouts mask invalid rows.

    Raises:
        TypeError: it creates its own kind of rollout buffer, in which nothing would be masked.
    """

    def _masked(self) -> ValidRolloutBuffer:
        if not isinstance(self.rollout_buffer, ValidRolloutBuffer):
            raise TypeError(
                f"{type(self).__name__}: creates a {type(self.rollout_buffer).__name__}, which learns from "
                "rows that a fault spoiled; use an algorithm that takes rollout_buffer_class"
            )
        return self.rollout_buffer

    def _setup_model(self) -> None:
        self.rollout_buffer_class = ValidRolloutBuffer
        super()._setup_model()
        self._masked()  # raises at once, not at the first fault

    def _update_info_buffer(self, infos: list[dict[str, Any]], dones: np.ndarray | None = None) -> None:
        super()._update_info_buffer(infos, dones)
        self._masked().mark(valid_rows(infos))

    def train(self) -> None:
        """Learn from the rollout, unless too few of its rows are valid.

        The deviation of a single advantage is NaN.
        """
        rollout = self._masked()
        if rollout.valid.sum() < (2 if getattr(self, "normalize_advantage", False) else 1):
            return
        super().train()
        valid = rollout.swap_and_flatten(rollout.valid).flatten()
        explained = explained_variance(rollout.values.flatten()[valid], rollout.returns.flatten()[valid])
        self.logger.record("train/explained_variance", explained)


class DQN(OffPolicyRows, sb3.DQN):
    """Deep Q-learning, for discrete actions."""


class SAC(OffPolicyRows, sb3.SAC):
    """Soft actor-critic, for continuous actions."""


class PPO(OnPolicyRows, sb3.PPO):
    """Proximal policy optimization, for discrete and continuous actions."""


class A2C(OnPolicyRows, sb3.A2C):
    """Advantage actor-critic, for discrete and continuous actions."""
