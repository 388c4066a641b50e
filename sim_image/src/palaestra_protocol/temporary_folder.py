"""A temporary folder that is removed when the process that made it ends, also after SIGKILL.

A second process, the keeper, removes the folder of a process that was killed. The standard input of the
keeper is a pipe from the folder's owner. The kernel closes this pipe when the owner and its forked children
have ended, for any reason.

The owner starts this file as the keeper, so the file imports only the standard library.
"""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

_GIVE_UP_S = 60.0  # time limit for processes of the owner that still write files into the folder
_PAUSE_S = 0.05
_BLOCKED = (signal.SIGHUP, signal.SIGINT, signal.SIGTERM)


@dataclass(frozen=True, slots=True)
class TemporaryFolder:
    """An empty folder that only this user can read, and the process ID of its keeper."""

    path: Path
    keeper: int


@contextlib.contextmanager
def temporary_folder(prefix: str, parent: Path | None = None) -> Iterator[TemporaryFolder]:
    """Make a folder for the block; the folder is removed with all files in it.

    Args:
        prefix: the beginning of the folder's name.
        parent: the folder in which to make it; by default the system's folder for temporary files (TMPDIR).

    Raises:
        OSError: the folder cannot be made or removed, or the system cannot start another process.
    """
    keeper, pipe = _start_keeper()
    path: Path | None = None
    try:
        with tempfile.TemporaryDirectory(prefix=prefix, dir=parent) as name:
            path = Path(name).absolute()
            os.write(pipe, os.fsencode(path))
            yield TemporaryFolder(path=Path(name), keeper=keeper.pid)
    finally:
        # Without the kill, the keeper would wait until all copies of the pipe are closed. A child of this
        # process may have such a copy.
        if path is None or not os.path.lexists(path):
            keeper.kill()
            keeper.wait()
        os.close(pipe)


def _start_keeper() -> tuple[subprocess.Popen[bytes], int]:
    """Start a keeper; return its process, and the pipe to it."""
    theirs, ours = os.pipe()
    # The keeper inherits the blocked signals, so from its start only SIGKILL can end it.
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, _BLOCKED)
    try:
        keeper = subprocess.Popen(
            [sys.executable, "-I", "-S", __file__],
            stdin=theirs,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
            cwd="/",
        )
    except OSError:
        os.close(ours)
        raise
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        os.close(theirs)
    return keeper, ours


def _keep() -> None:
    """Read the folder's path until standard input is closed; then remove the folder if it still exists."""
    folder = os.fsdecode(sys.stdin.buffer.read())
    give_up = time.monotonic() + _GIVE_UP_S
    while os.path.lexists(folder) and time.monotonic() < give_up:
        shutil.rmtree(folder, ignore_errors=True)
        time.sleep(_PAUSE_S)


if __name__ == "__main__":
    _keep()
