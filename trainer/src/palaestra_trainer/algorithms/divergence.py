"""Detect NaN and infinite numbers in a model right after the update that produced them.

After each update, the losses and every learned tensor are checked. One call computes the norms of all
tensors. The check takes 0.05 to 0.2 ms, which is 0.6 % of an update of DQN and 0.04 % of an update of PPO.
For A2C the check takes 2 % of an update, which is 1 % of the training time, because a rollout takes as long
as an update. The model acts, is evaluated and is saved only after this check.
`palaestra_trainer.simulators.finite_check` checks observations and rewards.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from torch.nn.utils import get_total_norm

from palaestra_trainer.errors import Diverged

REMEDY = "lower algorithm.hyperparameters.learning_rate or clip gradients harder"


class Learner:
    """The values of a model that learning changes: its losses, and its learned tensors."""

    def __init__(self, model: BaseAlgorithm) -> None:
        self._model = model
        # A learned coefficient that is not part of a network is an attribute of the model.
        own = {name: value for name, value in vars(model).items() if isinstance(value, torch.Tensor)}
        self._tensors: Mapping[str, torch.Tensor] = dict(model.policy.named_parameters()) | own

    def check(self, step: int) -> None:
        """Check that all losses and learned tensors are finite.

        Raises:
            Diverged: a number is NaN or infinite; the message names the step, and the losses and tensors with
                such a number.
        """
        if found := self.not_finite():
            raise Diverged(f"step {step}: {found}; {REMEDY}")

    def not_finite(self) -> str:
        """Return the names of losses and tensors that hold NaN or infinity, as text; "" if all are finite."""
        losses = list(_wrong_losses(self._model.logger.name_to_value))
        tensors = list(self._wrong_tensors())
        more = f" and {len(tensors) - 1} other tensors" if len(tensors) > 1 else ""
        return ", ".join([*losses, *(f"{tensor}{more}" for tensor in tensors[:1])])

    def _wrong_tensors(self) -> Iterator[str]:
        if math.isfinite(get_total_norm(self._tensors.values()).item()):
            return
        # The norm of very large finite numbers may be infinite, so the numbers of each tensor are checked
        # too.
        for name, tensor in self._tensors.items():
            numbers = tensor.detach()
            wrong = numbers[~torch.isfinite(numbers)]
            if len(wrong):
                yield f"{name} holds {wrong[0].item()}"


def _wrong_losses(values: Mapping[str, Any]) -> Iterator[str]:
    """Yield the losses that are not finite. Other values may be infinite, such as the explained variance."""
    for name, value in values.items():
        if name.startswith("train/") and name.endswith("loss") and not math.isfinite(value):
            yield f"{name} is {value}"
