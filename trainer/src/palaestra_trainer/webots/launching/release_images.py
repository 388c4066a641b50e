"""The images of this release; pure."""

from __future__ import annotations

import re
from importlib.metadata import version

from palaestra_trainer.errors import ConfigurationError

_SHIPPED = ("stub", "mujoco")
_OURS = re.compile(r"palaestra-(?:notebook|trainer)(?=[:@]|$)")


def release_image(driver: str, launcher: str, beside: str = "") -> str:
    """Return the image of this release with a simulator.

    Args:
        driver: the simulator program.
        launcher: the name of the launcher, for the message.
        beside: an image of this release, whose registry and tag the result gets.

    Raises:
        ConfigurationError: this release has no image with the simulator.
    """
    if driver not in _SHIPPED:
        raise ConfigurationError(
            f"launcher {launcher}: this release has no image for driver {driver}; give "
            f"{launcher.capitalize()}(image=...) an image with this simulator and palaestra-sidecar"
        )
    name = f"palaestra-{driver}"
    if _OURS.search(beside) and "@" not in beside:
        return _OURS.sub(name, beside)
    return f"{name}:{version('palaestra-trainer')}"
