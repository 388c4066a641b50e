"""Import MuJoCo; its compiled modules have no type information, so the module has the type Any."""

from __future__ import annotations

import importlib
import logging
from typing import Any

from palaestra_sim.errors import SimError

log = logging.getLogger(__name__)


class MissingLibraryError(SimError, ImportError):
    """MuJoCo is not installed; retrying cannot help."""


def _imported() -> Any:
    try:
        library = importlib.import_module("mujoco")
    except ImportError as error:
        fact = f"MuJoCo cannot be imported ({error})"
        raise MissingLibraryError(f"{fact}; install palaestra-sim[mujoco]") from error
    # Without this handler, MuJoCo writes its warnings into a file MUJOCO_LOG.TXT in the working directory.
    library.set_mju_user_warning(_warn)
    return library


def _warn(text: str) -> None:
    log.warning("MuJoCo: %s", text.strip())


mujoco: Any = _imported()
