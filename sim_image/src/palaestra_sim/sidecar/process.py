"""Start a simulator's process under a reaper, a small program that ends all descendants of the simulator.

No other module starts simulators. The sidecar and a reaper exchange messages through two pipes. Threads wait
for these messages, so no method of this module blocks. The sidecar may be process 1 of its container, and
process 1 inherits all orphans. So `reap` collects the exit status of every child that has ended: of reapers
and of orphans.
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
# Fields of /proc/PID/stat after the name: processor time of the process, and of its ended children, in ticks.
_OWN_TIME, _ENDED_TIME = slice(11, 13), slice(13, 15)  # Source: proc_pid_stat(5)
_LAST_OUTPUT_S = 0.2  # time limit for reading the rest of the output after the simulator has ended

_helpers: set[int] = set()  # running reapers, and the folder's keeper; every other child is an orphan
_helpers_lock = threading.Lock()  # held while a reaper is started and added to the set


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandLine:
    """A program with its arguments, its environment, and the prefix of its output lines (`mark`)."""

    arguments: tuple[str, ...]
    environment: Mapping[str, str]
    mark: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Started:
    """Reports that the first process of the simulator runs."""

    pid: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Ended:
    """Reports that the simulator and all of its descendants have ended.

    Attributes:
        code: the exit code; None if a signal ended the simulator.
        signal: the name of that signal, such as "SIGBUS"; otherwise None.
        problem: the reason for which both `code` and `signal` are unknown; otherwise None.
        last_line: the last line that the simulator printed.
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
        """Start a simulator and return its process.

        A thread calls `report` with `Started` after the start, and with `Ended` after the end.

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
        """Close the pipe to the reaper; the reaper then kills all remaining processes."""
        _close(self._commands)

    def usage(self) -> Usage:
        """Return the resource usage of all processes of the simulator; safe to call from any thread.

        Memory that several processes share counts once for each process.
        """
        below = found = reaper.children({self.reaper})
        while found := reaper.children(found):
            below |= found
        ticks = sum(_ticks(pid, _OWN_TIME) + _ticks(pid, _ENDED_TIME) for pid in below)
        cpu_s = (ticks + _ticks(self.reaper, _ENDED_TIME)) / os.sysconf("SC_CLK_TCK")
        # A process that ends during the count may be missing both as a running and as an ended process. Then
        # the sum falls, but a counter must not fall.
        self._cpu_s = max(self._cpu_s, cpu_s)
        pages = sum(_resident_pages(pid) for pid in below)
        return Usage(rss_bytes=pages * os.sysconf("SC_PAGE_SIZE"), cpu_s=self._cpu_s)

    def _say(self, command: bytes) -> None:
        with contextlib.suppress(BrokenPipeError):  # the reaper has ended; another thread reports that
            os.write(self._commands, command)


def spare(pid: int) -> None:
    """From now on, do not treat this child of the sidecar as an orphan of a simulator."""
    with _helpers_lock:
        _helpers.add(pid)


def reap() -> None:
    """Collect the exit status of every child that has ended, so that no child stays a zombie."""
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
    """Start a reaper in a new session, and return its process ID.

    Args:
        command: the command line of the simulator.
        descriptors: maps each descriptor of the reaper to the descriptor of this process that the reaper
            inherits as that number.
    """
    with _helpers_lock:
        pid = os.posix_spawn(
            sys.executable,
            [sys.executable, "-I", "-S", str(_REAPER), *command.arguments],
            dict(command.environment),
            file_actions=[(os.POSIX_SPAWN_DUP2, ours, its) for its, ours in descriptors.items()],
            setsid=True,
            setsigmask=(),
        )
        _helpers.add(pid)
        return pid


def _watch(reaper_pid: int, reports: int, reader: threading.Thread, passage: Passage, report: Report) -> None:
    """Pass the messages of a reaper to `report` until the reaper has ended."""
    said: dict[str, int] = {}
    with os.fdopen(reports) as lines:
        for line in lines:
            word, _, number = line.partition(" ")
            said[word] = int(number)
            if word == "started":
                report(Started(pid=said[word]))
    with _helpers_lock:
        _helpers.discard(reaper_pid)
    if "exit" not in said:
        _end_orphans()
    reader.join(_LAST_OUTPUT_S)
    report(_ended(said, passage.last_line))


def _end_orphans() -> None:
    """Kill the descendants of a killed reaper; these descendants are now children of this process."""
    while orphans := _kill_orphans():
        for pid in orphans:
            with contextlib.suppress(ChildProcessError):  # the signal thread has reaped the orphan
                os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT)
        reap()


def _kill_orphans() -> set[int]:
    with _helpers_lock:
        return reaper.kill_children(frozenset(_helpers))


def _ended(said: Mapping[str, int], last_line: str) -> Ended:
    if "error" in said:
        return Ended(problem=f"it could not be run: {os.strerror(said['error'])}", last_line=last_line)
    if "exit" not in said:
        return Ended(problem="the reaper of the simulator ended before the simulator", last_line=last_line)
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
