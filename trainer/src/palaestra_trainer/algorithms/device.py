"""Where a model's networks live: on the CPU, unless a job asked for a GPU and PyTorch sees one.

The CPU is the default beside a GPU too: networks of some hundred units learn faster there, and only there is
a run that was interrupted promised to end with the same numbers.
"""

from __future__ import annotations

import structlog
import torch

from palaestra_trainer.configuration import Device

log = structlog.get_logger(__name__)


def usable(wanted: Device) -> Device:
    """Return the device to use: `wanted`, or the CPU where PyTorch sees no GPU, which is logged."""
    if wanted == "cuda" and not torch.cuda.is_available():
        log.warning(
            "PyTorch sees no GPU, so the CPU is used",
            remedy="a trainer image that is built with TORCH=cuda, on a node with a GPU",
        )
        return "cpu"
    return wanted
