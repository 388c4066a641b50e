"""Make the report of a run whose trainer could not make it, because it was killed."""

import asyncio
import os
import signal
import subprocess
from pathlib import Path

from palaestra.local.process import Process, program_path
from palaestra.local.simulators import lack

PROGRAM = "palaestra-report"
REPORT = "report.html"
DEADLINE_S = 60.0
_WRITTEN_BY_THE_TRAINER = "end.json"  # each attempt removes it at its start, and writes it with its report


def complete_report(run_directory: Path) -> None:
    """Make the report of an ended run, unless its trainer has made it; do nothing if that is not possible.

    A run of another program than ours has no report, because it need not have the files for one.
    """
    began = (run_directory / "attempts.jsonl").exists()
    if began and not (run_directory / _WRITTEN_BY_THE_TRAINER).exists() and lack(PROGRAM) is None:
        asyncio.run(_make(run_directory))


async def _make(run_directory: Path) -> None:
    env = {**os.environ, "PATH": program_path()}
    command = (PROGRAM, str(run_directory))
    process = Process.start(command, env, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        await asyncio.wait_for(asyncio.shield(process.wait()), DEADLINE_S)
    except (TimeoutError, asyncio.CancelledError):
        process.send(signal.SIGKILL)  # safe: a report gets its name only when it is complete
        await process.wait()
