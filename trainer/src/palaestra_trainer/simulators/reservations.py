"""ROS names that no other simulator of this machine may take, from before its start to its end.

A name is free if no node of it runs and no program has reserved it. A reservation is a lock of the kernel on
a file, so it ends with the process that holds it.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import os
import tempfile
from collections.abc import Iterable
from pathlib import Path

from palaestra_trainer.ros import Master


class Reservation:
    """The names that one simulator holds."""

    def __init__(self) -> None:
        self._locks = contextlib.ExitStack()

    def take(self, names: Iterable[str]) -> bool:
        """Reserve all of `names`; False: one of them is in use, and none is held.

        Raises:
            MasterLost: no ROS master answers.
        """
        master = Master("/palaestra")
        for name in names:
            if not self._lock(f"{master.uri} {name}") or master.runs(f"/{name}"):
                self.release()
                return False
        return True

    def release(self) -> None:
        """Let others have the names."""
        self._locks.close()

    def _lock(self, what: str) -> bool:
        file = _folder() / hashlib.sha256(what.encode()).hexdigest()[:16]
        lock = os.open(file, os.O_CREAT | os.O_RDWR | os.O_CLOEXEC, 0o600)
        self._locks.callback(os.close, lock)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        return True


def _folder() -> Path:
    folder = Path(tempfile.gettempdir()) / f"palaestra-names-{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    return folder
