"""MuJoCo itself, whose compiled modules carry no types."""

from __future__ import annotations

import importlib
from typing import Any

from palaestra_sim.errors import SimError


class MissingLibraryError(SimError, ImportError):
    """MuJoCo is not installed; retrying cannot help."""


def _imported() -> Any:
    try:
        return importlib.import_module("mujoco")
    except ImportError as error:
        fact = f"MuJoCo cannot be imported ({error})"
        raise MissingLibraryError(f"{fact}; install palaestra-sim[mujoco]") from error


mujoco: Any = _imported()
