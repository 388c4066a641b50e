"""Check worlds in a separate process, with a budget for each world.

A check may contain an error, for example a run time that grows with the square of a world's size. The
separate process limits the effect to the job of the world's author; the operator continues to serve all jobs.
"""

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from typing import Final

import structlog

from palaestra.plan import GivenWorld, WorldVerdict

SECONDS = 20  # seconds of processor time for one world; the costliest known world of 900 kB takes 2 s
# Limit of the address space of a check; the costliest known world of 900 kB needs 135 MiB. The container has
# memory for two checks.
MEBIBYTES = 144
DEADLINE_S = 300.0  # seconds for all worlds of a job; the checks take longer only on a busy node
_CRASHES: Final = frozenset(  # exit code 1: an exception, whose traceback is in the operator's log
    (1, -signal.SIGABRT, -signal.SIGBUS, -signal.SIGFPE, -signal.SIGILL, -signal.SIGSEGV)
)
_PROGRAM = "palaestra.operator.world_check_main"
_REMEDY = "make the world smaller, or put it into the image and name it with world.file"

log = structlog.get_logger(__name__)


class WorldCheckProcess:
    """Runs the program that checks worlds, one process for each call; several threads may call it.

    Args:
        seconds: the limit of processor time for one world, in seconds.
        mebibytes: the limit of memory for one world, in MiB.
        deadline_s: the deadline for a whole call, in seconds.
    """

    def __init__(
        self, *, seconds: int = SECONDS, mebibytes: int = MEBIBYTES, deadline_s: float = DEADLINE_S
    ) -> None:
        self._seconds = seconds
        self._mebibytes = mebibytes
        self._deadline_s = deadline_s
        self._running: set[subprocess.Popen[bytes]] = set()
        self._lock = threading.Lock()
        self._stopped = False

    def check(self, worlds: Sequence[GivenWorld]) -> Mapping[str, WorldVerdict]:
        """Return the results of the checks by digest; a world without a result can be checked again."""
        lines, code = self._answers(worlds)
        ready, lines = bool(lines), lines[1:]
        verdicts = {
            world.digest: self._verdict(world, line) for world, line in zip(worlds, lines, strict=False)
        }
        if len(lines) < len(worlds):
            world = worlds[len(lines)]
            if (verdict := self._ended(world, code, ready=ready)) is not None:
                verdicts[world.digest] = verdict
        return verdicts

    def stop(self) -> None:
        """Kill all running checks; later calls of `check` return no results."""
        with self._lock:
            self._stopped = True
            for process in self._running:
                process.kill()

    def _answers(self, worlds: Sequence[GivenWorld]) -> tuple[list[bytes], int]:
        """Return the lines that the program wrote, and its exit code."""
        command = [sys.executable, "-I", "-m", _PROGRAM]
        limits = [str(os.getpid()), str(self._seconds), str(self._mebibytes)]
        with self._lock:
            if self._stopped:
                return [], -signal.SIGKILL
            try:
                process = subprocess.Popen([*command, *limits], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
            except OSError as error:  # the memory or the number of processes is exhausted
                log.warning("no process for the check of a world", error=str(error))
                return [], -signal.SIGKILL
            self._running.add(process)
        with process:
            try:
                said, _ = process.communicate(_written(worlds), self._deadline_s)
            except subprocess.TimeoutExpired:
                process.kill()
                said, _ = process.communicate()
        with self._lock:
            self._running.discard(process)
        return [line for line in said.splitlines(keepends=True) if line.endswith(b"\n")], process.returncode

    def _verdict(self, world: GivenWorld, line: bytes) -> WorldVerdict:
        answer = json.loads(line)
        if "exceeded" in answer:
            return self._too_costly(world, f"{self._mebibytes} MiB of memory")
        return WorldVerdict(problem=answer.get("problem", ""))

    def _ended(self, world: GivenWorld, code: int, *, ready: bool) -> WorldVerdict | None:
        """Return the result for the world at which the program ended; None if a retry may succeed."""
        if code == -signal.SIGXCPU:
            return self._too_costly(world, f"{self._seconds} s of processor time")
        if ready and code in _CRASHES:
            fact = f"the check crashes (exit code {code}); report this world"
            return WorldVerdict(problem=f"{world.field}: {fact}")
        if not self._stopped:
            log.warning("world not checked", field=world.field, code=code)
        return None

    def _too_costly(self, world: GivenWorld, budget: str) -> WorldVerdict:
        log.warning("world too costly to check", field=world.field, bytes=len(world.source), budget=budget)
        fact = f"its check needs more than {budget}, the limit for one world"
        return WorldVerdict(problem=f"{world.field}: {fact}; {_REMEDY}", too_costly=True)


def _written(worlds: Sequence[GivenWorld]) -> bytes:
    """Return the requests for worlds in the format of `world_check_main`."""
    requests = ({"field": world.field, "bytes": len(world.source)} for world in worlds)
    return b"".join(
        json.dumps(request).encode() + b"\n" + world.source
        for request, world in zip(requests, worlds, strict=True)
    )
