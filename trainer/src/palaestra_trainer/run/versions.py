"""Determine the versions of the software with which an attempt runs."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version

import torch

PACKAGES = (
    "palaestra-trainer",
    "palaestra-sim",
    "torch",
    "stable-baselines3",
    "sb3-contrib",
    "gymnasium",
    "numpy",
    "mujoco",
)
SIMULATING = ("palaestra-trainer", "palaestra-sim", "mujoco")  # an evaluation depends on these


def versions() -> dict[str, str]:
    """Return the version of each program that may affect a result, and a description of the machine."""
    found = {name: known for name in PACKAGES if (known := _version(name))}
    gpu = {"GPU": torch.cuda.get_device_name()} if torch.cuda.is_available() else {}
    machine = f"{platform.machine()}, {os.cpu_count()} processors"
    return (
        found | {"Python": platform.python_version(), "system": platform.platform(), "machine": machine} | gpu
    )


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None
