"""Check a world with the simulators of this machine, each of which is run with `--check`.

This package does not import simulators, so the simulator's own program makes the check.
"""

from __future__ import annotations

import asyncio
import os
import signal
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from palaestra.api import Driver
from palaestra.local.process import NOT_RUNNABLE, Process, program_path
from palaestra.local.simulators import PROGRAMS, lack

_CHECKERS: Final = (Driver.STUB, Driver.MUJOCO)
_DEADLINE_S: Final = 60.0
_TIMED_OUT: Final = 124


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldCheckResult:
    """The result of one simulator's check.

    Attributes:
        driver: the name of the driver in a TrainingJob.
        starts: whether the simulator can start the world with the options.
        text: the simulator's output.
    """

    driver: str
    starts: bool
    text: str


def check_world(world: Path, options: Sequence[str] = ()) -> tuple[WorldCheckResult, ...]:
    """Return the result of each simulator; without a response, `starts` is False.

    The stub is always run, and MuJoCo if it is installed. Each program gets the options with which a run
    would start it.
    """
    asked = [driver for driver in _CHECKERS if driver is Driver.STUB or lack(PROGRAMS[driver]) is None]
    return tuple(asyncio.run(_ask(driver, world, options)) for driver in asked)


async def _ask(driver: Driver, world: Path, options: Sequence[str]) -> WorldCheckResult:
    program = PROGRAMS[driver]
    with tempfile.TemporaryFile() as output:
        code = await _run([program, "--check", *options, str(world)], output.fileno())
        output.seek(0)
        text = output.read().decode(errors="replace").rstrip()
    if code == NOT_RUNNABLE:
        text = f"{program} is not installed on this machine"
    elif code == _TIMED_OUT:
        text = f"{program} did not respond within {_DEADLINE_S:.0f} s"
    return WorldCheckResult(driver=driver.value, starts=code == 0, text=text)


async def _run(command: list[str], output: int) -> int:
    env = {**os.environ, "PATH": program_path()}
    try:
        process = Process.start(command, env, stdout=output, stderr=output)
    except OSError:
        return NOT_RUNNABLE
    if not await process.ended_within(_DEADLINE_S):
        process.send(signal.SIGKILL)
        await process.wait()
        return _TIMED_OUT
    return await process.wait()
