"""Read and set the tensors that a rollout changes, which `algorithms.rollout_state` declares."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import torch
from stable_baselines3.common.base_class import BaseAlgorithm

from palaestra_trainer.algorithms.rollout_state import rollout_state_of


def networks(model: BaseAlgorithm) -> list[torch.Tensor]:
    """Return the tensors themselves, not copies, of the networks that a rollout changes."""
    return [
        tensor
        for name in rollout_state_of(model).networks
        for tensor in getattr(model, name).state_dict(keep_vars=True).values()
    ]


def memories(model: BaseAlgorithm) -> list[torch.Tensor]:
    """Return the states of the model's recurrent networks; later steps replace these tensors."""
    return [state for name in rollout_state_of(model).memories for state in _tensors(getattr(model, name))]


def remember(model: BaseAlgorithm, states: Sequence[torch.Tensor]) -> None:
    """Set the states of the model's recurrent networks to the result of `memories`.

    A member that is not in `states` keeps its current state, because it begins a new episode.
    """
    left = iter(states)
    for name in rollout_state_of(model).memories:
        setattr(model, name, _replaced(getattr(model, name), left))


def _tensors(states: Any) -> Iterator[torch.Tensor]:
    if isinstance(states, torch.Tensor):
        yield states
        return
    for part in states:
        yield from _tensors(part)


def _replaced(states: Any, left: Iterator[torch.Tensor]) -> Any:
    """Return `states` with the same nested types, and with the tensors of `left` instead of its own."""
    if isinstance(states, torch.Tensor):
        known = next(left).to(states.device)[:, : states.shape[1]]
        return torch.cat([known, states[:, known.shape[1] :]], dim=1)
    parts = [_replaced(part, left) for part in states]
    return type(states)(*parts) if hasattr(states, "_fields") else tuple(parts)
