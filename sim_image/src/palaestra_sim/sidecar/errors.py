"""Errors that are found before anything is started.

    SimError
    └── SidecarError (ValueError)   the sidecar cannot run as requested: retrying cannot help     exit 2

A message names the option or the file, the fact and the remedy.
"""

from palaestra_sim.errors import SimError


class SidecarError(SimError, ValueError):
    """The sidecar cannot run as requested. Nothing was started, and retrying cannot help."""
