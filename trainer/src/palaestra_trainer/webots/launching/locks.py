"""File locks between processes of one machine; the kernel releases a lock when its process ends.

The locks are POSIX record locks, which a forked process does not inherit. A forked process would inherit a
lock of `flock`, but the process must neither share nor release its parent's lock. A record lock does not
exclude other threads of its process. So this module keeps a set of the locks that this process holds.
"""

from __future__ import annotations

import fcntl
import os
import threading
from errno import EACCES, EAGAIN
from pathlib import Path
from typing import Self

from palaestra_trainer.errors import ConfigurationError

_held: set[tuple[int, Path]] = set()
_held_lock = threading.Lock()


class FileLock:
    """A lock that this process holds until `release` or its end."""

    def __init__(self, path: Path, descriptor: int) -> None:
        self._path = path
        self._descriptor: int | None = descriptor
        self._owner = os.getpid()

    @classmethod
    def acquire(cls, path: Path, variable: str) -> Self | None:
        """Lock a file; create it if it is missing. Return None if this or another process holds the lock.

        Args:
            path: the lock file.
            variable: the environment variable that names a folder above the file, for messages.

        Raises:
            ConfigurationError: the file cannot be written, or its file system does not support locks.
        """
        with _held_lock:
            mine = (os.getpid(), path)
            if mine in _held:  # if this process opened and closed the file again, it would lose the lock
                return None
            try:
                descriptor = _locked(path)
            except OSError as error:
                raise refusal(path, variable, error) from error
            if descriptor is None:
                return None
            _held.add(mine)
            return cls(path, descriptor)

    @property
    def held(self) -> bool:
        """Whether this process holds the lock; False in a process that was forked later."""
        return self._descriptor is not None and self._owner == os.getpid()

    def release(self) -> None:
        """Release the lock; further calls, and calls in a forked process, have no effect."""
        with _held_lock:
            if self.held and self._descriptor is not None:
                os.close(self._descriptor)
                self._descriptor = None
                _held.discard((self._owner, self._path))


def refusal(path: Path, variable: str, error: OSError) -> ConfigurationError:
    """Return the error for a lock file that cannot be used; see `FileLock.acquire`."""
    return ConfigurationError(
        f"{path}: the lock file of a simulator cannot be written and locked ({error.strerror}); "
        f"set {variable} to a folder on a local disk that this user can write"
    )


def _locked(path: Path) -> int | None:
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
    try:
        fcntl.lockf(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        os.close(descriptor)
        if error.errno in {EAGAIN, EACCES}:  # another process holds it. Source: fcntl(2)
            return None
        raise
    return descriptor
