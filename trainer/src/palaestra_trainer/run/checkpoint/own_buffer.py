"""Save and load the state of an author's buffer besides its rows: arrays, tensors and plain values."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm

from palaestra_trainer.algorithms.own_buffers import OwnBuffer

FILE = "buffer.npz"
_ARRAY, _TENSOR, _PLAIN = "array:", "tensor:", "plain"


def write(model: BaseAlgorithm, folder: Path) -> None:
    """Write the state of the model's buffer, if the buffer's class is from the job's author.

    Raises:
        ConfigurationError: the buffer has a value that a checkpoint cannot hold.
    """
    buffer = _own_buffer(model)
    if buffer is None:
        return
    arrays: dict[str, np.ndarray] = {}
    plain: dict[str, Any] = {}
    for name, value in buffer.own_state().items():
        if isinstance(value, np.ndarray):
            arrays[_ARRAY + name] = value
        elif isinstance(value, torch.Tensor):
            arrays[_TENSOR + name] = value.detach().cpu().numpy()
        else:
            plain[name] = value
    np.savez(folder / FILE, allow_pickle=False, **arrays, **{_PLAIN: np.array(json.dumps(plain))})


def read(model: BaseAlgorithm, folder: Path) -> None:
    """Read the file that `write` wrote, and load its state into the buffer of an equal model.

    Raises:
        OSError, ValueError, KeyError: the file is damaged.
    """
    buffer = _own_buffer(model)
    if buffer is None:
        return
    with np.load(folder / FILE, allow_pickle=False) as file:
        state: dict[str, Any] = json.loads(str(file[_PLAIN]))
        for name in file.files:
            if name.startswith(_ARRAY):
                state[name.removeprefix(_ARRAY)] = file[name]
            elif name.startswith(_TENSOR):
                state[name.removeprefix(_TENSOR)] = torch.from_numpy(file[name]).to(buffer.device)
    buffer.put_own_state(state)


def _own_buffer(model: BaseAlgorithm) -> OwnBuffer | None:
    for name in ("replay_buffer", "rollout_buffer"):
        if isinstance(buffer := getattr(model, name, None), OwnBuffer):
            return buffer
    return None
