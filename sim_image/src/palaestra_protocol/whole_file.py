"""Write files atomically: a reader sees the old or the new content, even if the writer is killed.

The content is written under a temporary name, which is then renamed. `replace_file` also waits until content
and name are on the disk, so the file survives a crash of the machine.
"""

from __future__ import annotations

import contextlib
import errno
import os
from collections.abc import Callable, Iterator
from pathlib import Path

_NO_SUCH_CALL = frozenset({errno.EINVAL, errno.ENOTSUP, errno.ENOSYS, errno.EBADF})


def write_whole(path: Path, content: bytes) -> None:
    """Create or replace the file `path`, without waiting for the disk; its folder must exist.

    This is enough for a simulator's files, because they are written again after a crash of the machine.

    Raises:
        OSError: the file cannot be written; no partial file is left.
    """
    with temporary(path) as unfinished:
        unfinished.write_bytes(content)
        unfinished.replace(path)


def replace_file(path: Path, write: Callable[[Path], object]) -> None:
    """Create or replace the file at `path` by the file that `write` writes to a temporary name.

    Raises:
        OSError: the file could not be written; the old file is unchanged.
    """
    with temporary(path) as unfinished:
        write(unfinished)
        sync(unfinished)
        unfinished.replace(path)
    sync(path.parent)


@contextlib.contextmanager
def temporary(path: Path) -> Iterator[Path]:
    """Yield a temporary path in the folder of `path` with the same suffix; remove that file at the end."""
    unfinished = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        yield unfinished
    finally:
        unfinished.unlink(missing_ok=True)


def sync(path: Path) -> None:
    """Wait until a file's or a folder's contents are on the disk.

    Some file systems over object stores and networks do not support fsync of a folder. On such a file system,
    this function does nothing for a folder.
    """
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in _NO_SUCH_CALL or not path.is_dir():
            raise
    finally:
        os.close(descriptor)
