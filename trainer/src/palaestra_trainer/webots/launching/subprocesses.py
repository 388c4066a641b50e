"""Child processes that end with this program, because each reads from a pipe at its standard input.

The kernel closes our end of the pipe when this program ends, even by a kill. The child stops when it reads
the end of the file.
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
    """Return a process in its own session that ends when this program exits.

    Raises:
        ConfigurationError: the program cannot be started.
    """
    try:
        process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=stderr, start_new_session=True
        )
    except OSError as error:
        fact = f"{command[0]} cannot be started ({error.strerror}); is it installed?"
        raise ConfigurationError(fact) from error
    atexit.register(end_child, process)
    return process


def end_child(process: subprocess.Popen[bytes]) -> None:
    """Close the pipe that keeps the process alive, and wait for its end; safe to repeat."""
    if process.stdin is not None:
        process.stdin.close()
    process.wait(_ANSWER_S)
    for pipe in (process.stdout, process.stderr):
        if pipe is not None:
            pipe.close()


def drain(process: subprocess.Popen[bytes]) -> None:
    """Read and drop the later output of the process, because a full pipe would block it forever."""
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
        SimulatorDead: it printed no line in time.
    """
    if process.stdout is None:
        raise ValueError("the process was started without a pipe for its output")
    with selectors.DefaultSelector() as selector:
        selector.register(process.stdout, selectors.EVENT_READ)
        if not selector.select(_ANSWER_S):
            raise SimulatorDead(str(process.args), f"printed nothing within {_ANSWER_S:g} s")
    return process.stdout.readline().decode(errors="replace")
