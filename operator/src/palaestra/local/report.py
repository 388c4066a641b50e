"""Write the report of a run whose trainer was killed or still trains."""

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
# A trainer removes this file when an attempt starts, and writes it at the end, just before the report.
_WRITTEN_BY_THE_TRAINER = "end.json"


def complete_report(run_directory: Path) -> None:
    """Write the report of a run if its trainer was killed or still trains; do nothing if this fails.

    A run of a custom program gets no report, because such a run may lack the necessary files.
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
        # SIGKILL is safe, because a report gets its name only when it is complete.
        process.send(signal.SIGKILL)
        await process.wait()
