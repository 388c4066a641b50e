"""Run one replica for another program, and end with that program: `python -m palaestra.local.child_main`.

`palaestra.run` starts this process in a session of its own. So the process has its own event loop and
signals, and Ctrl-C in a terminal or notebook does not reach it. Standard input is a file with the request,
and standard output is a log file of limited size.

The run saves a checkpoint and ends when the other program closes its end of a pipe, writes to the pipe, or
ends in any way. A forked child of the other program has a copy of that end, which would keep the pipe open.
So this process also watches whether the other program has ended.
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

# Seconds between two checks whether the parent still runs. A pidfd would report the parent's end at once, but
# some systems have no pidfd.
PARENT_CHECK_S = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class ChildRequest:
    """The job as YAML, the options of its run, and the process and descriptors on which the run depends.

    `process` is the id of the process with which the run ends. `control` is the descriptor of this end of the
    pipe, and `lock` is the descriptor of the run directory's lock.
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
    # If the program that started this process has already ended, this process has another parent.
    if os.getppid() != request.process:
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
