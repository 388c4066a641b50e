"""Which process drives which simulator: a lock on one file for each, in the container's scratch folder."""

from __future__ import annotations

import os
import re
import tempfile
from pathlib import Path
from typing import NamedTuple

from palaestra_trainer.configuration import Configuration, Role, SimulatorConfiguration
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.locks import FileLock


class Claim(NamedTuple):
    """One simulator, and the lock that keeps other environments from it."""

    simulator: SimulatorConfiguration
    lock: FileLock


def claim(configuration: Configuration, role: Role) -> Claim:
    """Return a claim on the first simulator with this role that no environment has, in any process.

    Raises:
        ConfigurationError: there is none left, or the lock's file cannot be written.
    """
    simulators = configuration.with_role(role)
    for simulator in simulators:
        if lock := _lock(_path(configuration, simulator)):
            return Claim(simulator, lock)
    raise ConfigurationError(_none_left(len(simulators), role, len(configuration.simulators)))


def _lock(path: Path) -> FileLock | None:
    try:
        return FileLock.acquire(path)
    except OSError as error:
        raise ConfigurationError(
            f"{path}: the lock of a simulator cannot be written ({error.strerror}); "
            "let ROS_LOG_DIR name a folder of this user's"
        ) from error


def _path(configuration: Configuration, simulator: SimulatorConfiguration) -> Path:
    """Return the lock's file; ROS_LOG_DIR is the scratch folder in every container that the plan describes.

    Named by the address, too: outside of a container the folder may be shared by several jobs and users.
    """
    address = simulator.control or f"{configuration.job}-{configuration.replica}"
    words = re.sub(r"\W+", "-", f"{os.getuid()} {address} {simulator.name}")
    return Path(os.environ.get("ROS_LOG_DIR") or tempfile.gettempdir()) / f"palaestra-claim-{words}.lock"


def _none_left(having_role: int, role: Role, total: int) -> str:
    other = "Evaluate" if role == "Collect" else "Collect"
    return (
        f"PALAESTRA_CONFIG: {having_role} of {total} simulators have role {role}, and each of them has an "
        f"environment; add simulators with that role to the job, close an environment, or make one with "
        f'role="{other}" of those that have it'
    )
