"""Pass copies of the inputs to networks whose code comes from a job's author.

Stable-Baselines3 passes an array to a network, and later stores the same array as a row. It also passes the
same batch to the networks of actor and critic. A network that writes into its input would change the data for
learning.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from torch import nn

_LIBRARIES = {"palaestra_trainer", "sb3_contrib", "stable_baselines3", "torch"}


def give_copies(model: BaseAlgorithm) -> None:
    """Pass copies of the inputs to each network of the job's author in the policy of `model`."""
    _hook(model.policy, set())


def _hook(module: nn.Module, seen: set[int]) -> None:
    """Hook the outermost modules of other packages; `seen` holds the ids of visited modules."""
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
