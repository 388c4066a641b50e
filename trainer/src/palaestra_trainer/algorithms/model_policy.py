"""The policy of a model in training: raw observations in, actions out."""

from __future__ import annotations

from typing import Any

from stable_baselines3.common.base_class import BaseAlgorithm

from palaestra_trainer.algorithms.masks import takes_masks
from palaestra_trainer.algorithms.normalization import normalizer_of


class ModelPolicy:
    """The policy of a model, which normalizes raw observations as in its training.

    Attributes:
        model: the model; it needs normalized observations if it has a normalizer.
        takes_masks: whether `predict` needs `action_masks`.
    """

    def __init__(self, model: BaseAlgorithm) -> None:
        self.model = model
        self.takes_masks = takes_masks(model)
        self._normalizer = normalizer_of(model)

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = False,  # noqa: FBT001, FBT002 - as in Stable-Baselines3
        **masks: Any,
    ) -> tuple[Any, Any]:
        """Return an action for a raw observation, and the policy's next state.

        The statistics of the normalizer do not change. MaskablePPO takes `masks`.
        """
        seen = self._normalizer.normalize_obs(observation) if self._normalizer else observation
        return self.model.predict(seen, state, episode_start, deterministic, **masks)
