"""Locks between processes of one machine, each on a file, that the kernel frees with their process.

They are POSIX record locks, which a forked process does not inherit. It would inherit those of `flock`, and
of the libraries above it, but a worker that was forked must neither share its parent's lock nor release it.
Within one process a record lock excludes nothing, so a set has those of this one.
"""

from __future__ import annotations

import fcntl
import os
import threading
from pathlib import Path
from typing import Self

_held: set[tuple[int, Path]] = set()
_held_lock = threading.Lock()


class FileLock:
    """A lock that this process holds until `release` or its end."""

    def __init__(self, path: Path, descriptor: int) -> None:
        self._path = path
        self._descriptor: int | None = descriptor
        self._owner = os.getpid()

    @classmethod
    def acquire(cls, path: Path) -> Self | None:
        """Return the lock on a file, which is made if it is not there; None: it is held, here or elsewhere.

        Raises:
            OSError: the file cannot be written.
        """
        with _held_lock:
            mine = (os.getpid(), path)
            if mine in _held:  # to open and close the file once more would free the lock
                return None
            descriptor = _locked(path)
            if descriptor is None:
                return None
            _held.add(mine)
            return cls(path, descriptor)

    @property
    def held(self) -> bool:
        """Whether this process holds it; a process that was forked since does not."""
        return self._descriptor is not None and self._owner == os.getpid()

    def release(self) -> None:
        """Free the lock; safe to repeat, without effect in a forked process."""
        with _held_lock:
            if self.held and self._descriptor is not None:
                os.close(self._descriptor)
                self._descriptor = None
                _held.discard((self._owner, self._path))


def _locked(path: Path) -> int | None:
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
    try:
        fcntl.lockf(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        return None
    except OSError:
        os.close(descriptor)
        raise
    return descriptor
