"""Settings by which a run learns nothing, or takes other steps than it says: reported, not refused."""

from __future__ import annotations

from collections.abc import Iterator

from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm

from palaestra_trainer.algorithms.values import FIELD


def futile(model: BaseAlgorithm, steps: int) -> Iterator[str]:
    """Yield a line for each setting of a new model that does not fit the steps of its run."""
    if isinstance(model, OffPolicyAlgorithm) and model.learning_starts >= steps:
        yield (
            f"{FIELD}.learning_starts: {model.learning_starts} is not less than steps ({steps}), so nothing "
            "is learned; lower it, or raise steps"
        )
    if isinstance(model, OnPolicyAlgorithm) and (rollout := model.n_steps * model.n_envs) > steps:
        yield (
            f"{FIELD}.n_steps: a rollout is {rollout} steps ({model.n_steps} of each simulator), so the run "
            f"takes {rollout} steps, not {steps}, and learns once; lower it, or raise steps"
        )
