"""Run a program of the package palaestra-trainer, which needs PyTorch, in a separate process.

The program itself writes to the person's terminal. Ctrl-C reaches this process, which sends SIGTERM to the
program; a second Ctrl-C kills the program. All processes of the program end with this process.
"""

from __future__ import annotations

import asyncio
import shutil
import signal
import subprocess
import sys
import uuid
from collections.abc import Mapping, Sequence

from palaestra.local.errors import KILLED, RunRefused
from palaestra.local.interrupt import Interrupt
from palaestra.local.process import OrphanKiller, Process, marked, program_path
from palaestra.local.simulators import lack


def run_program(
    command: Sequence[str], env: Mapping[str, str] | None = None, *, reads_keys: bool = False
) -> int:
    """Run a program and return its exit code; 130 if Ctrl-C ended it.

    Args:
        command: the program's name and its arguments.
        env: variables that differ from those of this process.
        reads_keys: whether the program reads this process's standard input.

    Raises:
        RunRefused: the program is not installed here.
    """
    require_program(command[0])
    return asyncio.run(_run(command, env or {}, sys.stdin.fileno() if reads_keys else subprocess.DEVNULL))


def require_program(name: str) -> str:
    """Return the path of a program of palaestra-trainer that is installed here.

    Raises:
        RunRefused: the program is not installed here.
    """
    if (problem := lack(name)) is not None:
        raise RunRefused(f"{problem}: it is a program of the package palaestra-trainer")
    return shutil.which(name, path=program_path()) or name


class _Program:
    """A started program, as the target of signals."""

    def __init__(self, process: Process) -> None:
        self._process = process

    def stop(self) -> None:
        """Send SIGTERM to the program."""
        self._process.send(signal.SIGTERM)

    def kill(self) -> None:
        """Kill the program."""
        self._process.send(signal.SIGKILL)


async def _run(command: Sequence[str], env: Mapping[str, str], stdin: int) -> int:
    interrupt, mark = Interrupt(), str(uuid.uuid4())
    orphans = OrphanKiller(mark)
    try:
        with interrupt.listening():
            process = Process.start(
                command,
                marked(env, mark, command[0]),
                stdout=sys.stdout.fileno(),
                stderr=sys.stderr.fileno(),
                stdin=stdin,
            )
            interrupt.pass_to(_Program(process))
            code = await process.wait()
    finally:
        await orphans.closed()
    return KILLED if interrupt.signals and code else code
