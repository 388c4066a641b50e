"""What can be wrong before anything is started.

    SimError
    └── SidecarError (ValueError)   the sidecar cannot run as asked: retrying cannot help     exit 2

A message names the option or the file, the fact and the remedy.
"""

from palaestra_sim.errors import SimError


class SidecarError(SimError, ValueError):
    """The sidecar cannot run as asked, so nothing was started and retrying cannot help."""
