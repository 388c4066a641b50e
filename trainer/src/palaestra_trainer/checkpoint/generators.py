"""The random generators that training draws from: where they stand, as plain data."""

from __future__ import annotations

import random
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from gymnasium import spaces


@dataclass(frozen=True, slots=True, kw_only=True)
class Generators:
    """Where Python's, NumPy's, PyTorch's and the action space's generator stand."""

    python: tuple[Any, ...]
    numpy: dict[str, Any]
    torch: torch.Tensor
    action_space: dict[str, Any]

    @classmethod
    def now(cls, action_space: spaces.Space[Any]) -> Generators:
        """Return where they stand now."""
        return cls(
            python=random.getstate(),
            numpy=np.random.get_state(legacy=False),  # noqa: NPY002 - the one that Stable-Baselines3 draws from
            torch=torch.get_rng_state(),
            action_space=dict(action_space.np_random.bit_generator.state),
        )

    def put_back(self, action_space: spaces.Space[Any]) -> None:
        """Let them go on from here."""
        random.setstate(self.python)
        np.random.set_state(self.numpy)  # noqa: NPY002 - see now()
        torch.set_rng_state(self.torch)
        action_space.np_random.bit_generator.state = self.action_space

    def to_json(self) -> dict[str, Any]:
        """Return them as JSON data."""
        twister = self.numpy["state"]
        return {
            "python": self.python,
            "numpy": self.numpy | {"state": twister | {"key": twister["key"].tolist()}},
            "torch": self.torch.numpy().tobytes().hex(),
            "action_space": self.action_space,
        }

    @classmethod
    def from_json(cls, content: dict[str, Any]) -> Generators:
        """Return what `to_json` wrote."""
        version, words, gauss = content["python"]
        numpy = content["numpy"]
        key = np.array(numpy["state"]["key"], dtype=np.uint32)
        return cls(
            python=(version, tuple(words), gauss),
            numpy=numpy | {"state": numpy["state"] | {"key": key}},
            torch=torch.frombuffer(bytearray.fromhex(content["torch"]), dtype=torch.uint8),
            action_space=content["action_space"],
        )
