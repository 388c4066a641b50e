"""Reserve the ROS names of a simulator on this machine, from the time before its start until its end.

A name is free if no program has reserved the name, and no node of that name runs.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Iterable
from pathlib import Path

from palaestra_trainer.ros import Master
from palaestra_trainer.webots.launching.locks import FileLock, refusal

TEMPORARY = "TMPDIR"  # the environment variable that names the folder for temporary files


class Reservation:
    """The ROS names that are reserved for one simulator."""

    def __init__(self) -> None:
        self._locks: list[FileLock] = []

    def take(self, names: Iterable[str]) -> bool:
        """Reserve all of `names` and return True; if a name is in use, reserve none and return False.

        Raises:
            MasterLost: no ROS master responds.
            ConfigurationError: the folder for temporary files cannot be written, or does not support locks.
        """
        master = Master("/palaestra")
        for name in names:
            if not self._lock(f"{master.uri} {name}") or master.runs(f"/{name}"):
                self.release()
                return False
        return True

    def release(self) -> None:
        """Release the names."""
        while self._locks:
            self._locks.pop().release()

    def _lock(self, what: str) -> bool:
        lock = FileLock.acquire(_folder() / hashlib.sha256(what.encode()).hexdigest()[:16], TEMPORARY)
        if lock is not None:
            self._locks.append(lock)
        return lock is not None


def _folder() -> Path:
    folder = Path(tempfile.gettempdir()) / f"palaestra-names-{os.getuid()}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
    except OSError as error:
        raise refusal(folder, TEMPORARY, error) from error
    return folder
