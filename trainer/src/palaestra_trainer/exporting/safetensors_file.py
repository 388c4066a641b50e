"""Write a policy's tensors to a safetensors file, for a network that a user builds.

The name of a tensor is `policy.` and its name in Stable-Baselines3's policy. The names of the statistics of
the n-th input's normalizer begin with `normalizers.<n>.`. The data sheet has the clip value of each
normalizer.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from copy import deepcopy
from typing import Any

import numpy as np
import safetensors.torch
import torch

from palaestra_trainer.exporting.metadata import KEY
from palaestra_trainer.exporting.policy_module import PolicyModule
from palaestra_trainer.exporting.verify import Arrays, Run


def content(acting: PolicyModule, sheet: Mapping[str, Any]) -> bytes:
    """Return the bytes of the file, with the data sheet in its metadata."""
    # Each tensor is copied. Some policies have a network under two names, and the format does not allow
    # tensors that share memory.
    tensors = {name: tensor.detach().clone().contiguous() for name, tensor in acting.state_dict().items()}
    return safetensors.torch.save(tensors, {KEY: json.dumps(sheet)})


def runner(file: bytes, acting: PolicyModule) -> Run:
    """Return a function that runs a copy of the policy with the tensors of the file."""
    copy = deepcopy(acting)
    with torch.no_grad():
        for tensor in copy.state_dict().values():
            tensor.zero_()
    copy.load_state_dict(safetensors.torch.load(file), strict=True)

    def run(*inputs: np.ndarray) -> Arrays:
        with torch.no_grad():
            return tuple(output.numpy() for output in copy(*map(torch.from_numpy, inputs)))

    return run
