"""Copies of the inputs of networks that a job brings.

Stable-Baselines3 gives a network the memory in which it keeps the observation until it stores the row, and
gives the networks of actor and critic the same batch. One that writes into its input would change what is
learned from.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from torch import nn

_LIBRARIES = {"palaestra_trainer", "sb3_contrib", "stable_baselines3", "torch"}


def give_copies(model: BaseAlgorithm) -> None:
    """Let each network of the job's author that the policy of `model` calls get copies of its input."""
    _hook(model.policy, set())


def _hook(module: nn.Module, seen: set[int]) -> None:
    """Hook the outermost modules of other packages; a module may be a part of several."""
    if id(module) in seen:
        return
    seen.add(id(module))
    if type(module).__module__.partition(".")[0] not in _LIBRARIES:
        module.register_forward_pre_hook(_copies)
        return
    for part in module.children():
        _hook(part, seen)


def _copies(module: nn.Module, inputs: tuple[Any, ...]) -> Any:
    del module
    return tuple(map(_copy, inputs))


def _copy(value: Any) -> Any:
    if isinstance(value, torch.Tensor):
        return value.clone()
    return {key: _copy(part) for key, part in value.items()} if isinstance(value, Mapping) else value
