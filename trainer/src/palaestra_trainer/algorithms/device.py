"""Choose the device of a model: the CPU, unless a job requests a GPU and PyTorch finds a GPU.

The CPU is the default even if the node has a GPU, because networks of some hundred units learn faster on the
CPU. A resumed run ends with exactly the same numbers only on the CPU.
"""

from __future__ import annotations

import structlog
import torch

from palaestra_trainer.job.configuration import Device

log = structlog.get_logger(__name__)


def usable(wanted: Device) -> Device:
    """Return the wanted device; if PyTorch does not find a GPU, log a warning and return the CPU."""
    if wanted == "cuda" and not torch.cuda.is_available():
        log.warning(
            "PyTorch sees no GPU, so the CPU is used",
            remedy="a trainer image that is built with TORCH=cuda, on a node with a GPU",
        )
        return "cpu"
    return wanted
