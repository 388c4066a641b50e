"""Export a policy with `palaestra-export`, which needs PyTorch; this package does not."""

from __future__ import annotations

import asyncio
import os
import signal
import sys
from pathlib import Path

from palaestra.local.errors import RunRefused
from palaestra.local.process import Process, program_path
from palaestra.local.simulators import lack

PROGRAM = "palaestra-export"


def export(run: Path, to: str, output: Path | None) -> int:
    """Run the trainer's program that exports the policy of a run directory; return its exit code.

    Raises:
        RunRefused: the program is not installed here.
    """
    if (problem := lack(PROGRAM)) is not None:
        raise RunRefused(f"{problem}: it is a program of the package palaestra-trainer")
    chosen = [] if output is None else ["--output", str(output)]
    return asyncio.run(_run([PROGRAM, str(run), "--to", to, *chosen]))


async def _run(command: list[str]) -> int:
    env = {**os.environ, "PATH": program_path()}
    process = Process.start(command, env, stdout=sys.stdout.fileno(), stderr=sys.stderr.fileno())
    try:
        return await process.wait()
    except asyncio.CancelledError:  # Ctrl-C; an incomplete file is removed or has a hidden name
        process.send(signal.SIGTERM)
        await process.wait()
        raise
