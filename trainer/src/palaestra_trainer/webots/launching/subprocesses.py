"""Start child processes that end when this program ends, by a pipe to their standard input.

The kernel closes this program's end of the pipe when the program ends, even after a kill. The child then
reads the end of its input and stops.
"""

from __future__ import annotations

import atexit
import contextlib
import selectors
import subprocess
import threading
from typing import IO

from palaestra_trainer.errors import ConfigurationError, SimulatorDead

_ANSWER_S = 20.0


def start_child(command: list[str], stderr: int) -> subprocess.Popen[bytes]:
    """Start a process in its own session that ends when this program exits; return the process.

    Raises:
        ConfigurationError: the program cannot be started.
    """
    try:
        process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=stderr, start_new_session=True
        )
    except OSError as error:
        fact = f"{command[0]} cannot be started ({error.strerror}); install it, or put it on the PATH"
        raise ConfigurationError(fact) from error
    atexit.register(end_child, process)
    return process


def end_child(process: subprocess.Popen[bytes]) -> None:
    """Close the pipe that keeps the process alive, and wait for its end; further calls have no effect."""
    if process.stdin is not None:
        process.stdin.close()
    process.wait(_ANSWER_S)
    for pipe in (process.stdout, process.stderr):
        if pipe is not None:
            pipe.close()


def drain(process: subprocess.Popen[bytes]) -> None:
    """Read and drop the further output of the process, because a full pipe would block the process."""
    for pipe in (process.stdout, process.stderr):
        if pipe is not None:
            threading.Thread(target=_drop, args=(pipe,), daemon=True).start()


def _drop(pipe: IO[bytes]) -> None:
    # `end_child` may close the pipe while this thread reads.
    with contextlib.suppress(OSError, ValueError):
        while pipe.read1(65536):  # type: ignore[attr-defined]  # Popen's pipes are buffered
            pass


def first_line(process: subprocess.Popen[bytes]) -> str:
    """Return the first line of the process's output; empty if the process ended without output.

    Raises:
        SimulatorDead: the process did not print a line in time.
    """
    if process.stdout is None:
        raise ValueError("the process was started without a pipe for its output")
    with selectors.DefaultSelector() as selector:
        selector.register(process.stdout, selectors.EVENT_READ)
        if not selector.select(_ANSWER_S):
            raise SimulatorDead(str(process.args), f"printed nothing within {_ANSWER_S:g} s")
    return process.stdout.readline().decode(errors="replace")
