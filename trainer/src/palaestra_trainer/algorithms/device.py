"""The device of a model's networks: the CPU, unless a job requests a GPU and PyTorch finds one.

The CPU is the default even with a GPU. Networks of some hundred units learn faster on it. Only on the CPU
does a resumed run end with exactly the same numbers.
"""

from __future__ import annotations

import structlog
import torch

from palaestra_trainer.job.configuration import Device

log = structlog.get_logger(__name__)


def usable(wanted: Device) -> Device:
    """Return the device to use: `wanted`, or the CPU if PyTorch finds no GPU, which is logged."""
    if wanted == "cuda" and not torch.cuda.is_available():
        log.warning(
            "PyTorch sees no GPU, so the CPU is used",
            remedy="a trainer image that is built with TORCH=cuda, on a node with a GPU",
        )
        return "cpu"
    return wanted
