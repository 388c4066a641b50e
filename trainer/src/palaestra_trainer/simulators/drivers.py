"""Change the simulator program of a configuration: the stub, MuJoCo or Webots."""

from __future__ import annotations

import importlib.util
import shutil
from pathlib import Path

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.simulator_configuration import SimulatorConfiguration

DRIVERS = ("stub", "mujoco", "webots")
_SAME_OPTIONS = {"stub", "mujoco"}
_MJCF = ".xml"


def in_driver(entry: SimulatorConfiguration, driver: str) -> SimulatorConfiguration:
    """Return the simulator with the same world in another program.

    The command-line options stay only if both programs accept the same options.

    Raises:
        ConfigurationError: the program is not installed, or cannot load the world.
    """
    if driver == "mujoco" and importlib.util.find_spec("mujoco") is None:
        raise ConfigurationError(
            "--in mujoco: the Python package mujoco is not installed; install palaestra-sim[mujoco]"
        )
    if driver == "webots" and shutil.which("webots") is None:
        raise ConfigurationError("--in webots: webots is not a program on this machine; install it")
    if driver != "mujoco" and Path(entry.world).suffix == _MJCF:
        raise ConfigurationError(
            f"--in {driver}: {Path(entry.world).name} is a model of MuJoCo, which {driver} cannot load; "
            "use --in mujoco"
        )
    kept = entry.driver == driver or {entry.driver, driver} <= _SAME_OPTIONS
    return entry.model_copy(update={"driver": driver, "options": entry.options if kept else ()})
