"""The one module that starts processes: a simulator, under a reaper that ends all of its descendants.

The sidecar talks to the reaper through two pipes, and threads wait for its end, so nothing here blocks. The
sidecar reaps children for the whole container, because it may be process 1: `reap` collects every child that
ended, both reapers and the orphans that only process 1 inherits.
"""

import contextlib
import os
import signal
import sys
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from palaestra_sim.sidecar import reaper
from palaestra_sim.sidecar.output import Passage

_REAPER = Path(reaper.__file__)
# In /proc/PID/stat after the name: time of the process, and of its children that have ended, in ticks.
_OWN_TIME, _ENDED_TIME = slice(11, 13), slice(13, 15)  # Source: proc_pid_stat(5)
_LAST_OUTPUT_S = 0.2  # time for lines that are still in the pipe after the simulator has ended

_reapers: set[int] = set()  # running reapers: the only children that are not orphans
_reapers_lock = threading.Lock()  # held from the start of a reaper until it is in the set


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandLine:
    """A program with its arguments, its environment, and the prefix of each line that it prints."""

    arguments: tuple[str, ...]
    environment: Mapping[str, str]
    mark: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Started:
    """A report: the simulator's first process runs."""

    pid: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Ended:
    """A report: the simulator and all of its descendants have ended.

    `code` or `signal` (as "SIGBUS") is set; if both are unknown, `problem` is the reason.
    `last_line` is the last line that the simulator printed.
    """

    code: int | None = None
    signal: str | None = None
    problem: str | None = None
    last_line: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Usage:
    """The memory of all processes of a simulator, and their processor time since its start."""

    rss_bytes: int = 0
    cpu_s: float = 0.0


Report = Callable[[Started | Ended], None]


class SimulatorProcess:
    """A simulator's process and all of its descendants.

    Attributes:
        reaper: the reaper's process id; all processes of the simulator are its descendants.
    """

    def __init__(self, reaper_pid: int, commands: int) -> None:
        self.reaper = reaper_pid
        self._commands = commands
        self._cpu_s = 0.0

    @classmethod
    def start(cls, command: CommandLine, report: Report) -> Self:
        """Start a simulator; a thread calls `report`: with Started, and at the end once with Ended.

        Raises:
            OSError: the system cannot start another process.
        """
        (commands, our_commands), (our_reports, reports) = os.pipe(), os.pipe()
        our_output, output = os.pipe()
        try:
            pid = _spawn(command, {0: commands, 1: output, 2: output, reaper.REPORTS: reports})
        except OSError:
            _close(our_commands, our_reports, our_output)
            raise
        finally:
            _close(commands, output, reports)
        passage = Passage(our_output, command.mark)
        reader = threading.Thread(target=passage.run, name="output", daemon=True)
        watcher = threading.Thread(
            target=_watch, args=(pid, our_reports, reader, passage, report), name="reports", daemon=True
        )
        reader.start()
        watcher.start()
        return cls(pid, our_commands)

    def terminate(self) -> None:
        """Send SIGTERM to the simulator's process group."""
        self._say(reaper.TERMINATE)

    def kill(self) -> None:
        """Kill the simulator and all of its descendants."""
        self._say(reaper.KILL)

    def close(self) -> None:
        """Close the pipe to the reaper, which then kills all remaining processes."""
        _close(self._commands)

    def usage(self) -> Usage:
        """Return the usage of all processes of the simulator; shared pages count twice. Thread-safe."""
        below = found = reaper.children({self.reaper})
        while found := reaper.children(found):
            below |= found
        ticks = sum(_ticks(pid, _OWN_TIME) + _ticks(pid, _ENDED_TIME) for pid in below)
        cpu_s = (ticks + _ticks(self.reaper, _ENDED_TIME)) / os.sysconf("SC_CLK_TCK")
        self._cpu_s = max(self._cpu_s, cpu_s)  # a process that ends during the count may be missing in both
        pages = sum(_resident_pages(pid) for pid in below)
        return Usage(rss_bytes=pages * os.sysconf("SC_PAGE_SIZE"), cpu_s=self._cpu_s)

    def _say(self, command: bytes) -> None:
        with contextlib.suppress(BrokenPipeError):  # the reaper has ended, so Ended will be reported
            os.write(self._commands, command)


def reap() -> None:
    """Collect the exit status of every child that has ended, so that none stays a zombie."""
    with contextlib.suppress(ChildProcessError):
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass


def _resident_pages(pid: int) -> int:
    with contextlib.suppress(OSError, IndexError):  # the process may have ended
        return int(Path(f"/proc/{pid}/statm").read_bytes().split()[1])
    return 0


def _ticks(pid: int, fields: slice) -> int:
    with contextlib.suppress(OSError, ValueError):  # the process may have ended
        behind_name = Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2]
        return sum(int(field) for field in behind_name.split()[fields])
    return 0


def _spawn(command: CommandLine, descriptors: Mapping[int, int]) -> int:
    """Start the reaper with these descriptors as its own, detached from the terminal."""
    with _reapers_lock:
        pid = os.posix_spawn(
            sys.executable,
            [sys.executable, "-I", "-S", str(_REAPER), *command.arguments],
            dict(command.environment),
            file_actions=[(os.POSIX_SPAWN_DUP2, ours, its) for its, ours in descriptors.items()],
            setsid=True,
            setsigmask=(),
        )
        _reapers.add(pid)
        return pid


def _watch(reaper_pid: int, reports: int, reader: threading.Thread, passage: Passage, report: Report) -> None:
    """Report the reaper's messages until it has ended."""
    said: dict[str, int] = {}
    with os.fdopen(reports) as lines:
        for line in lines:
            word, _, number = line.partition(" ")
            said[word] = int(number)
            if word == "started":
                report(Started(pid=said[word]))
    with _reapers_lock:
        _reapers.discard(reaper_pid)
    if "exit" not in said:
        _end_orphans()
    reader.join(_LAST_OUTPUT_S)
    report(_ended(said, passage.last_line))


def _end_orphans() -> None:
    """Kill the descendants of a reaper that was killed itself; they are now children of this process."""
    while orphans := _kill_orphans():
        for pid in orphans:
            with contextlib.suppress(ChildProcessError):  # the signal thread has reaped it
                os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT)
        reap()


def _kill_orphans() -> set[int]:
    with _reapers_lock:
        return reaper.kill_children(frozenset(_reapers))


def _ended(said: Mapping[str, int], last_line: str) -> Ended:
    if "error" in said:
        return Ended(problem=f"it could not be run: {os.strerror(said['error'])}", last_line=last_line)
    if "exit" not in said:
        return Ended(problem="its reaper ended before it", last_line=last_line)
    code = os.waitstatus_to_exitcode(said["exit"])
    if code >= 0:
        return Ended(code=code, last_line=last_line)
    return Ended(signal=_signal_name(-code), last_line=last_line)


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"SIG{number}"  # a real-time signal without a name


def _close(*descriptors: int) -> None:
    for descriptor in descriptors:
        os.close(descriptor)
