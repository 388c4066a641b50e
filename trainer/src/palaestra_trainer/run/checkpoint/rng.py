"""Save and restore the states of the random generators that training uses."""

from __future__ import annotations

import random
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from gymnasium import spaces


@dataclass(frozen=True, slots=True, kw_only=True)
class Generators:
    """The states of the generators of Python, NumPy, PyTorch and the action space.

    Attributes:
        gpu: state of PyTorch's generator on the GPU of the model; None: the model is on the CPU.
    """

    python: tuple[Any, ...]
    numpy: dict[str, Any]
    pytorch: torch.Tensor
    action_space: dict[str, Any]
    gpu: torch.Tensor | None = None

    @classmethod
    def now(cls, action_space: spaces.Space[Any], device: torch.device) -> Generators:
        """Return the current states."""
        return cls(
            python=random.getstate(),
            numpy=np.random.get_state(legacy=False),
            pytorch=torch.get_rng_state(),
            action_space=dict(action_space.np_random.bit_generator.state),
            gpu=torch.cuda.get_rng_state(device) if device.type == "cuda" else None,
        )

    def put_back(self, action_space: spaces.Space[Any], device: torch.device) -> None:
        """Set the generators to these states; set the GPU's generator only if the model is on a GPU now."""
        random.setstate(self.python)
        np.random.set_state(self.numpy)
        torch.set_rng_state(self.pytorch)
        action_space.np_random.bit_generator.state = self.action_space
        if self.gpu is not None and device.type == "cuda":
            torch.cuda.set_rng_state(self.gpu, device)

    def to_json(self) -> dict[str, Any]:
        """Return the states as JSON data."""
        twister = self.numpy["state"]
        content = {
            "python": self.python,
            "numpy": self.numpy | {"state": twister | {"key": twister["key"].tolist()}},
            "torch": _as_text(self.pytorch),
            "action_space": self.action_space,
        }
        return content if self.gpu is None else content | {"gpu": _as_text(self.gpu)}

    @classmethod
    def from_json(cls, content: dict[str, Any]) -> Generators:
        """Return the states that `to_json` wrote."""
        version, words, gauss = content["python"]
        numpy = content["numpy"]
        key = np.array(numpy["state"]["key"], dtype=np.uint32)
        return cls(
            python=(version, tuple(words), gauss),
            numpy=numpy | {"state": numpy["state"] | {"key": key}},
            pytorch=_from_text(content["torch"]),
            action_space=content["action_space"],
            gpu=_from_text(content["gpu"]) if "gpu" in content else None,
        )


def _as_text(state: torch.Tensor) -> str:
    return state.numpy().tobytes().hex()


def _from_text(text: str) -> torch.Tensor:
    return torch.frombuffer(bytearray.fromhex(text), dtype=torch.uint8)
