"""Run one replica for another program, and end with it: `python -m palaestra.local.child_main`.

`palaestra.run` starts it in a session of its own, so that it has its own event loop and signals, and Ctrl-C
in a terminal or notebook does not reach it. Standard input is a file with the request, and standard output a
log file of limited size.

The run saves a checkpoint and ends when the other program closes its end of a pipe, writes to it, or ends in
any way. A copy of that end in a forked child would keep the pipe open, so the end of the process is watched
too.
"""

import json
import os
import select
import signal
import sys
from dataclasses import asdict, dataclass
from importlib.metadata import version
from io import BufferedWriter, TextIOWrapper
from pathlib import Path
from threading import Thread
from typing import Self

from palaestra.api import load
from palaestra.errors import PalaestraError
from palaestra.local.bounded_log import LimitedFile
from palaestra.local.errors import LocalError
from palaestra.local.output import say
from palaestra.local.run import RunOptions, run
from palaestra_protocol.pod.status import ExitCode
from palaestra_sim.errors import SimError

PARENT_CHECK_S = 0.5  # the kernel reports a parent's end only through a pidfd, which some systems lack


@dataclass(frozen=True, slots=True, kw_only=True)
class ChildRequest:
    """The job as YAML, the options of its run, and the process and descriptors that it depends on.

    `process` is the process with which the run ends. `control` is the descriptor of this end of the pipe, and
    `lock` that of the run directory's lock.
    """

    job: str
    runs: str
    replica: int
    fresh: bool
    process: int
    control: int
    lock: int

    def to_json(self) -> bytes:
        """Return the request as JSON."""
        return json.dumps(asdict(self)).encode()

    @classmethod
    def from_json(cls, content: bytes) -> Self:
        """Return the request from the JSON of `to_json`."""
        return cls(**json.loads(content))


def main() -> int:
    """Run the request on standard input, and return the exit code of `palaestra run`."""
    request = ChildRequest.from_json(sys.stdin.buffer.read())
    sys.stdout = TextIOWrapper(BufferedWriter(LimitedFile(sys.stdout.fileno())), errors="replace")
    if os.getppid() != request.process:  # it has already ended, so another process is the parent
        return int(ExitCode.INTERRUPTED)
    Thread(target=_end_with, args=(request.control, request.process), daemon=True).start()
    options = RunOptions(
        runs=Path(request.runs),
        version=version("palaestra"),
        replica=request.replica,
        fresh=request.fresh,
        lock=request.lock,
    )
    try:
        return run(load(request.job), options)
    except LocalError as error:
        say(str(error))
        return error.exit_code
    except (PalaestraError, SimError) as error:
        say(str(error))
        return int(ExitCode.CONFIGURATION)


def _end_with(control: int, process: int) -> None:
    """Interrupt this process once, as Ctrl-C does, when the other program requests it or has ended."""
    while os.getppid() == process and not select.select([control], [], [], PARENT_CHECK_S)[0]:
        pass
    os.kill(os.getpid(), signal.SIGTERM)


if __name__ == "__main__":
    sys.exit(main())
