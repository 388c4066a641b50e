"""The project's cache, outside of the checkout: its folder, its locks, and the removal of old files."""

import fcntl
import os
import shutil
import signal
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from tools.images.errors import ImagesError


def folder(environment: Mapping[str, str] = os.environ) -> Path:
    """Return the cache's folder, absolute."""
    if chosen := environment.get("PALAESTRA_CACHE"):
        return Path(chosen).absolute()
    users = environment.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(users).absolute() / "palaestra"


@contextmanager
def locked(file: Path, deadline_s: int) -> Iterator[None]:
    """Hold a lock, so that two calls never make the same file; the system releases it at this process's end.

    Only the main thread may call this function, because SIGALRM ends the wait for the other call.

    Raises:
        ImagesError: another call has held the lock for `deadline_s`, or the file system has no locks.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("w") as handle:
        signal.signal(signal.SIGALRM, partial(_give_up, file))
        signal.alarm(deadline_s)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX)
        except OSError as error:
            fact = f"{file}: the file system has no locks ({error.strerror})"
            raise ImagesError(f"{fact}; set XDG_CACHE_HOME to a folder on a local disk") from error
        finally:
            signal.alarm(0)
        yield


def use(path: Path) -> None:
    """Set the access time of a file or folder, but not the modification time, which other code compares."""
    os.utime(path, ns=(time.time_ns(), path.stat().st_mtime_ns))


def prune(paths: Iterable[Path], kept: int) -> None:
    """Remove these files and folders, except the `kept` most recently used."""
    for path in sorted(paths, key=lambda path: path.stat().st_atime_ns, reverse=True)[kept:]:
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink()


def _give_up(file: Path, *_: object) -> None:
    raise ImagesError(f"{file}: another process holds this lock; end the process that `fuser {file}` names")
