"""Allocate simulators to environments of any process, by a lock file per simulator."""

from __future__ import annotations

import os
import re
import tempfile
from pathlib import Path
from typing import NamedTuple

from palaestra_protocol.pod.enums import Role
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Configuration
from palaestra_trainer.job.simulator_configuration import SimulatorConfiguration
from palaestra_trainer.webots.launching.locks import FileLock


class Allocation(NamedTuple):
    """One simulator, and the lock that reserves it for one environment."""

    simulator: SimulatorConfiguration
    lock: FileLock


def allocate(configuration: Configuration, role: Role) -> Allocation:
    """Allocate the first simulator with this role that no environment of any process uses.

    Raises:
        ConfigurationError: all simulators with this role are in use, or the lock file cannot be written and
            locked.
    """
    simulators = configuration.with_role(role)
    for simulator in simulators:
        if lock := FileLock.acquire(_path(configuration, simulator), "ROS_LOG_DIR"):
            return Allocation(simulator, lock)
    raise ConfigurationError(_none_left(len(simulators), role, len(configuration.simulators)))


def _path(configuration: Configuration, simulator: SimulatorConfiguration) -> Path:
    """Return the path of the lock file, in the scratch folder ROS_LOG_DIR of the containers.

    The file name also contains the address of the sidecar, because outside a container several jobs and users
    may share the folder.
    """
    address = simulator.control or f"{configuration.job}-{configuration.replica}"
    words = re.sub(r"\W+", "-", f"{os.getuid()} {address} {simulator.name}")
    return Path(os.environ.get("ROS_LOG_DIR") or tempfile.gettempdir()) / f"palaestra-claim-{words}.lock"


def _none_left(having_role: int, role: Role, total: int) -> str:
    other = Role.EVALUATE if role == Role.COLLECT else Role.COLLECT
    return (
        f"PALAESTRA_CONFIG: {having_role} of {total} simulators have role {role}, and each has an "
        f"environment; add simulators with that role to the job, close an environment, or create one "
        f'with role="{other}"'
    )
