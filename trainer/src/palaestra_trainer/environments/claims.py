"""Which process drives which simulator: a lock on one file for each, in the container's scratch folder.

The kernel frees the lock with its process, however that ends. The locks are POSIX record locks, which a
forked process does not inherit. It would inherit those of `flock`, and of the libraries above it, but a
worker that was forked must neither share its parent's claim nor release it. Within one process a record
lock excludes nothing, so a set has the claims of this one.
"""

from __future__ import annotations

import fcntl
import os
import re
import tempfile
import threading
from pathlib import Path

from palaestra_trainer.configuration import Configuration, Role, SimulatorConfiguration
from palaestra_trainer.errors import ConfigurationError

_held: set[tuple[int, Path]] = set()
_held_lock = threading.Lock()


class Claim:
    """One simulator, held by this process until `release` or its end.

    Attributes:
        simulator: the entry of the configuration.
    """

    def __init__(self, simulator: SimulatorConfiguration, path: Path, descriptor: int) -> None:
        self.simulator = simulator
        self._path = path
        self._descriptor: int | None = descriptor
        self._owner = os.getpid()

    @property
    def held(self) -> bool:
        """Whether this process holds it; a process that was forked since does not."""
        return self._descriptor is not None and self._owner == os.getpid()

    def release(self) -> None:
        """Free the simulator for another environment; safe to repeat, without effect in a forked process."""
        with _held_lock:
            if self.held and self._descriptor is not None:
                os.close(self._descriptor)
                self._descriptor = None
                _held.discard((self._owner, self._path))


def claim(configuration: Configuration, role: Role) -> Claim:
    """Return a claim on the first simulator with this role that no environment has, in any process.

    Raises:
        ConfigurationError: there is none left, or the lock's file cannot be written.
    """
    simulators = configuration.with_role(role)
    for simulator in simulators:
        if claimed := _claim(simulator, _path(configuration, simulator)):
            return claimed
    raise ConfigurationError(_none_left(len(simulators), role, len(configuration.simulators)))


def _claim(simulator: SimulatorConfiguration, path: Path) -> Claim | None:
    with _held_lock:
        mine = (os.getpid(), path)
        if mine in _held:  # to open and close the file once more would free the lock
            return None
        descriptor = _locked(path)
        if descriptor is None:
            return None
        _held.add(mine)
        return Claim(simulator, path, descriptor)


def _locked(path: Path) -> int | None:
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
    except OSError as error:
        raise ConfigurationError(
            f"{path}: the lock of a simulator cannot be written ({error.strerror}); "
            "let ROS_LOG_DIR name a folder of this user's"
        ) from error
    try:
        fcntl.lockf(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        return None
    except OSError:
        os.close(descriptor)
        raise
    return descriptor


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
