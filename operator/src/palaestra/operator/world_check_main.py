"""The program that checks worlds; its process limits its own time and memory.

The program writes one line when it is ready. A request is a line of JSON followed by the bytes of a world;
the response is a line of JSON with the result. The program writes no files, and ends when its parent ends.
Only the operator runs it, with this command:

    python -m palaestra.operator.world_check_main PARENT SECONDS MEBIBYTES
"""

import ctypes
import gc
import json
import os
import resource
import signal
import sys
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path

from palaestra_sim.errors import WorldError
from palaestra_sim.world import check

MOST_CHARACTERS = 4096  # the longest message of a refusal; a status shows fewer characters
TOO_MUCH_MEMORY = "memory"
_NICENESS = 5  # the operator's own process has priority over a check
_PR_SET_PDEATHSIG = 1  # Source: linux/prctl.h
_OOM_SCORE = Path("/proc/self/oom_score_adj")


def main() -> None:
    """Check worlds until the standard input ends."""
    parent, seconds, mebibytes = map(int, sys.argv[1:])
    _end_with(parent)
    _limit(mebibytes)
    # A world's tree of nodes has no cycles, so garbage collections would visit the whole tree without effect.
    gc.disable()
    _write({})
    for field, source in _requests():
        _give_time(seconds)
        _write(_verdict(field, source))


def _write(answer: Mapping[str, str]) -> None:
    sys.stdout.write(json.dumps(answer) + "\n")
    sys.stdout.flush()


def _requests() -> Iterator[tuple[str, bytes]]:
    """Yield the field and the bytes of each world."""
    for line in sys.stdin.buffer:
        request = json.loads(line)
        yield request["field"], sys.stdin.buffer.read(request["bytes"])


def _verdict(field: str, source: bytes) -> dict[str, str]:
    """Return the refusal of a world, or the exceeded budget; {} if the world is valid."""
    try:
        check(source, field)
    except WorldError as error:
        return {"problem": str(error)[:MOST_CHARACTERS]}
    except MemoryError:
        return {"exceeded": TOO_MUCH_MEMORY}
    return {}


def _end_with(parent: int) -> None:
    """Request from the kernel that it kills this process as soon as the parent ends."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:  # the parent ended before this call
        sys.exit(1)


def _limit(mebibytes: int) -> None:
    """Limit the memory, forbid files and core dumps, and make this process the OOM killer's first choice."""
    _bound(resource.RLIMIT_AS, mebibytes << 20)
    _bound(resource.RLIMIT_CORE, 0)
    _bound(resource.RLIMIT_FSIZE, 0)
    os.nice(_NICENESS)
    with suppress(OSError):  # other systems have no such file
        _OOM_SCORE.write_text("1000")


def _give_time(seconds: int) -> None:
    """Limit the processor time from now on; when it is used up, the kernel ends the process with SIGXCPU."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    _bound(resource.RLIMIT_CPU, int(used.ru_utime + used.ru_stime) + 1 + seconds)


def _bound(kind: int, most: int) -> None:
    """Set a limit of this process, unless the existing hard limit is lower."""
    _, hard = resource.getrlimit(kind)
    resource.setrlimit(kind, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))


if __name__ == "__main__":
    main()
