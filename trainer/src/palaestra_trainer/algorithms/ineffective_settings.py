"""Settings that make a run learn little or exceed its steps; the trainer logs them, but accepts the job."""

from __future__ import annotations

from collections.abc import Iterator
from typing import cast

from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm
from stable_baselines3.common.type_aliases import TrainFreq, TrainFrequencyUnit

from palaestra_trainer.algorithms.hyperparameters import FIELD
from palaestra_trainer.algorithms.reinforce import REINFORCE


def futile(model: BaseAlgorithm, steps: int) -> Iterator[str]:
    """Yield a warning for each setting of a new model that is unsuitable for the steps of its run."""
    if isinstance(model, OffPolicyAlgorithm) and model.learning_starts >= steps:
        yield (
            f"{FIELD}.learning_starts: {model.learning_starts} is not less than steps ({steps}), so nothing "
            "is learned; lower it, or raise steps"
        )
    if isinstance(model, OffPolicyAlgorithm) and (rollout := _steps_of_rollout(model)) > steps:
        yield (
            f"{FIELD}.train_freq: {rollout} steps come before each update, but the run has only {steps}, "
            "so the policy is updated once; lower train_freq, or raise steps"
        )
    if isinstance(model, REINFORCE) and model.episodes_per_update >= steps:
        yield (
            f"{FIELD}.episodes_per_update: {model.episodes_per_update} episodes are more than the run has in "
            f"{steps} steps, so the run takes more steps and updates the policy once; lower this field, or "
            "raise steps"
        )
    if isinstance(model, OnPolicyAlgorithm) and (rollout := model.n_steps * model.n_envs) > steps:
        yield (
            f"{FIELD}.n_steps: a rollout is {rollout} steps ({model.n_steps} of each simulator), so the run "
            f"takes {rollout} steps, not {steps}, and updates the policy once; lower n_steps, or raise steps"
        )


def _steps_of_rollout(model: OffPolicyAlgorithm) -> int:
    """Return the steps of all members before an update; 0 if an update waits for whole episodes."""
    frequency = cast("TrainFreq", model.train_freq)
    return frequency.frequency * model.n_envs if frequency.unit is TrainFrequencyUnit.STEP else 0
