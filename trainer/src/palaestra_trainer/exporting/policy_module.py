"""A policy as one PyTorch module that maps observations of the environment to deterministic actions.

Like `TrainedPolicy.predict`, the module also handles channels of images, normalization, and the bounds of
actions. For a recurrent policy, the module takes the policy's state as inputs and returns the next state. The
state at the start of an episode is zeros. For a policy of MaskablePPO, masks are a further input;
`palaestra_trainer.environments.masks` describes masks.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.preprocessing import is_image_space, is_image_space_channels_first
from torch import nn

from palaestra_trainer.algorithms.images import transposed_images
from palaestra_trainer.environments.data_sheet import OBSERVATION, parts_of
from palaestra_trainer.environments.masks import ACTION_MASKS, choices_of
from palaestra_trainer.errors import ExportError
from palaestra_trainer.run.policies import TrainedPolicy

STATE = ("hidden", "cell")  # the state of a recurrent policy; shape (layers, observations, units)


class Normalizer(nn.Module):
    """Normalizes a part of an observation as `TrainedPolicy.predict` does, with the same precision.

    Args:
        mean: mean of each number in this part of the training's observations; has the part's shape.
        variance: variance of the same numbers; has the same shape.
        clip: largest absolute value of a result.
        epsilon: number that is added to the variance.
    """

    mean: torch.Tensor
    variance: torch.Tensor

    def __init__(self, mean: np.ndarray, variance: np.ndarray, clip: float, epsilon: float) -> None:
        super().__init__()
        self.clip, self.epsilon = clip, epsilon
        self.register_buffer("mean", torch.from_numpy(np.asarray(mean, np.float64)))
        self.register_buffer("variance", torch.from_numpy(np.asarray(variance, np.float64)))

    def forward(self, part: torch.Tensor) -> torch.Tensor:
        """Return a normalized batch."""
        scaled = (part.double() - self.mean) / torch.sqrt(self.variance + self.epsilon)
        return torch.clamp(scaled, -self.clip, self.clip).float()


class PolicyModule(nn.Module):
    """A deterministic policy with its normalizers, as a PyTorch module.

    Args:
        loaded: the policy, on the CPU; the module sets it to evaluation mode.

    Raises:
        ExportError: an observation has the name of the input for masks.

    Attributes:
        spaces: the space of each input, in the layout of the environment.
        action_space: the space of an action.
        choices: the count of choices for each number of an action; empty: the policy does not take masks.
        state_shape: layers and units of the state; None: the policy has no state.
        normalizers: the normalizer of each input, in the order of `spaces`; `Identity` for an input that is
            not normalized.
    """

    def __init__(self, loaded: TrainedPolicy) -> None:
        super().__init__()
        policy: Any = loaded.model.policy
        policy.set_training_mode(False)
        self.policy = policy
        self.action_space: spaces.Space[Any] = loaded.model.action_space
        self._seen = parts_of(loaded.model.observation_space)
        self.spaces = _as_returned(loaded.model, self._seen)
        self.choices = choices_of(self.action_space) if loaded.takes_masks else []
        if self.choices and ACTION_MASKS in self.spaces:
            raise ExportError(
                f"the observation has a key {ACTION_MASKS}, but the exported policy needs this name for its "
                "input of masks; nothing was written; rename the key in the environment"
            )
        lstm = getattr(policy, "lstm_actor", None)
        self.state_shape = None if lstm is None else (int(lstm.num_layers), int(lstm.hidden_size))
        scales = {key or OBSERVATION: scale for key, scale in loaded.scales.items()}
        self.normalizers = nn.ModuleList(
            Normalizer(*scales[name]) if name in scales else nn.Identity() for name in self.spaces
        )

    @property
    def inputs(self) -> list[str]:
        """The names of the inputs in their order."""
        masks = [ACTION_MASKS] if self.choices else []
        return [*self.spaces, *masks, *(STATE if self.state_shape else ())]

    @property
    def outputs(self) -> list[str]:
        """The names of the outputs in their order."""
        return ["action", *(f"next_{name}" for name in STATE if self.state_shape)]

    def begin(self, observations: int) -> tuple[torch.Tensor, ...]:
        """Return the state at the start of an episode for a batch; empty for a policy without state."""
        if self.state_shape is None:
            return ()
        layers, units = self.state_shape
        return tuple(torch.zeros(layers, observations, units) for _ in STATE)

    def forward(self, *inputs: torch.Tensor) -> tuple[torch.Tensor, ...]:
        """Return the actions for a batch, and the next state of a recurrent policy."""
        observation = self.seen(inputs)
        if self.state_shape is None:
            masks = {ACTION_MASKS: inputs[-1]} if self.choices else {}
            return (self._bounded(self.policy._predict(observation, deterministic=True, **masks)),)
        action, state = self.policy._predict(observation, *self.memory(inputs), deterministic=True)
        return (self._bounded(action), *state)

    def seen(self, inputs: tuple[torch.Tensor, ...]) -> Any:
        """Return the observations of a batch in the form that the networks need."""
        parts = zip(self.spaces, self.normalizers, inputs, strict=False)
        seen = {name: self._channels_first(name, normalize(part)) for name, normalize, part in parts}
        return seen if list(seen) != [OBSERVATION] else seen[OBSERVATION]

    def memory(self, inputs: tuple[torch.Tensor, ...]) -> tuple[Any, ...]:
        """Return the state in the inputs, and flags of new episodes; empty for a policy without state."""
        if self.state_shape is None:
            return ()
        hidden, cell = inputs[len(self.spaces) :]
        # The flags of new episodes are always 0, because the caller passes a state of zeros for a new
        # episode.
        return (hidden, cell), torch.zeros_like(hidden[0, :, 0])

    def _channels_first(self, name: str, part: torch.Tensor) -> torch.Tensor:
        """Return a batch of images with channels first; return other parts unchanged."""
        return part.permute(0, 3, 1, 2) if self.spaces[name].shape != self._seen[name].shape else part

    def _bounded(self, action: torch.Tensor) -> torch.Tensor:
        """Return actions within the bounds of the environment's space."""
        space = self.action_space
        if not isinstance(space, spaces.Box):
            return action
        low, high = torch.from_numpy(space.low), torch.from_numpy(space.high)
        action = action.reshape(-1, *space.shape)
        if self.policy.squash_output:
            return low + 0.5 * (action + 1.0) * (high - low)
        return torch.minimum(torch.maximum(action, low), high)


class Scoring(PolicyModule):
    """A module that returns the scores of discrete actions, for the comparison of a file with its policy.

    The policy takes the action with the best score. This module is never written to a file. Its only output
    has the name of the action. Masks do not change the scores.
    """

    @property
    def outputs(self) -> list[str]:
        """The name of the output with the scores."""
        return ["action"]

    def forward(self, *inputs: torch.Tensor) -> tuple[torch.Tensor, ...]:
        """Return the scores for a batch.

        Raises:
            AttributeError: the policy does not have the networks and distributions of Stable-Baselines3's
                policies.
        """
        observation = self.seen(inputs)
        if hasattr(self.policy, "q_net"):
            return (self.policy.q_net(observation),)
        if hasattr(self.policy, "quantile_net"):
            return (self.policy.quantile_net(observation).mean(dim=1),)
        found = self.policy.get_distribution(observation, *self.memory(inputs))
        one = found[0] if isinstance(found, tuple) else found
        made = one.distributions if hasattr(one, "distributions") else one.distribution
        return (torch.cat([part.logits for part in made], dim=1) if isinstance(made, list) else made.logits,)


def _as_returned(model: BaseAlgorithm, seen: Mapping[str, spaces.Space[Any]]) -> dict[str, spaces.Space[Any]]:
    """Return the parts of a model's observations as the environment returns them.

    An older release did not note the images that the model gets transposed. Almost all environments return
    images with channels last, so all images of such a model count as transposed.
    """
    noted = transposed_images(model)
    transposed = seen.keys() if noted is None else {key or OBSERVATION for key in noted}
    return {name: _channels_last(space) if name in transposed else space for name, space in seen.items()}


def _channels_last(space: spaces.Space[Any]) -> spaces.Space[Any]:
    """Return the space of images with channels last; other spaces unchanged."""
    if not (isinstance(space, spaces.Box) and is_image_space(space) and is_image_space_channels_first(space)):
        return space
    low, high = (np.moveaxis(bound, 0, -1) for bound in (space.low, space.high))
    return spaces.Box(low, high, dtype=np.uint8)
