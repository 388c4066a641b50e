"""The reaper: a program, between the sidecar and a simulator, that ends all the simulator's processes.

The sidecar starts one reaper for each start of the simulator, as `python -I -S reaper.py PROGRAM ...`. The
standard input of the reaper is a pipe from the sidecar; its descriptor 3 is a pipe to the sidecar:

    in   T             send SIGTERM to the simulator's process group
         K, or EOF     kill all processes; EOF also arrives when the sidecar was killed with SIGKILL
    out  started PID   the simulator's first process runs
         error ERRNO   the simulator's program could not be run
         exit STATUS   the first process ended with this wait status, and all of its descendants have ended

The reaper is a subreaper: if a descendant loses its parent, the descendant becomes a child of the reaper.
The reaper gets this descendant even after `setsid`, a double fork or a change of environment. A process
group, a parent-death signal or a marker in the environment would lose such a process.

To end the simulator, the reaper kills its children until it has no more children. When a killed process ends,
the kernel first makes the children of this process children of the reaper (exit_notify). Then the kernel
sends SIGCHLD, at which the reaper searches for children again. So the reaper needs no timer.

The sidecar starts this file directly, so it imports only the standard library.
"""

import contextlib
import ctypes
import os
import select
import signal
import sys

COMMANDS = 0
REPORTS = 3
TERMINATE = b"T"
KILL = b"K"

_PR_SET_CHILD_SUBREAPER = 36  # Source: linux/prctl.h
_GIVE_UP_S = 20.0  # if a process survives SIGKILL for this long, it hangs in the kernel
_NOT_RUN = 127  # a shell exits with this code if it does not find a program
_PARENT = 1  # index of the parent among the fields after the name in /proc/PID/stat: state, parent, ...


def adopt_orphans() -> None:
    """Make this process the parent of each of its descendants that loses its own parent.

    Raises:
        OSError: the kernel refused the request.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0) != 0:
        raise OSError(ctypes.get_errno(), "prctl(PR_SET_CHILD_SUBREAPER)")


def children(parents: set[int]) -> set[int]:
    """Read all of /proc once; return the IDs of the processes whose parent is one of `parents`."""
    found = set()
    for name in os.listdir("/proc"):
        if name.isdigit():
            with contextlib.suppress(OSError):  # the process may have ended
                with open(f"/proc/{name}/stat", "rb") as file:
                    fields = file.read().rpartition(b")")[2].split()
                if int(fields[_PARENT]) in parents:
                    found.add(int(name))
    return found


def kill_children(spared: frozenset[int] = frozenset()) -> set[int]:
    """Send SIGKILL to every child of this process except those in `spared`; return the other children.

    The signal cannot hit a wrong process, because the system does not reuse the ID of a child before this
    process has reaped the child.
    """
    found = children({os.getpid()}) - spared
    for pid in found:
        with contextlib.suppress(OSError):  # a child that now runs as another user cannot be killed
            os.kill(pid, signal.SIGKILL)
    return found


def main() -> None:
    """Start the program in `argv` and run the sidecar's commands until all processes have ended."""
    for number in (signal.SIGHUP, signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    adopt_orphans()
    woken, wake = os.pipe()
    os.set_blocking(woken, False)
    os.set_blocking(wake, False)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    signal.set_wakeup_fd(wake, warn_on_full_buffer=False)
    os.set_inheritable(REPORTS, False)
    pid = _spawn(sys.argv[1:])
    _report(f"started {pid}")
    _report(f"exit {_keep(pid, woken)}")


def _keep(pid: int, woken: int) -> int:
    """Wait until the process `pid` and all of its descendants have ended; return its wait status."""
    status: int | None = None
    ending = False
    while True:
        ended = _reap()
        status = ended.get(pid, status)
        if None in ended:
            return status or 0
        if ending := ending or status is not None:
            kill_children()
        ready, _, _ = select.select(
            [woken] if ending else [woken, COMMANDS], [], [], _GIVE_UP_S if ending else None
        )
        if not ready:
            return status if status is not None else signal.SIGKILL
        if woken in ready:
            with contextlib.suppress(BlockingIOError):
                os.read(woken, 4096)
        if COMMANDS in ready:
            ending = _obey(pid)


def _obey(pid: int) -> bool:
    """Run one command of the sidecar; return whether the command is to kill all processes.

    `pid` is the simulator's first process; it is not reaped yet.
    """
    command = os.read(COMMANDS, 1)
    if command == TERMINATE:
        with contextlib.suppress(ProcessLookupError):  # the process has not created its group yet
            os.killpg(pid, signal.SIGTERM)
    return command != TERMINATE


def _reap() -> dict[int | None, int]:
    """Reap every child that has ended; return the wait status of each, by process ID.

    The result has the key None if no child is left.
    """
    ended: dict[int | None, int] = {}
    try:
        while (result := os.waitpid(-1, os.WNOHANG))[0]:
            ended[result[0]] = result[1]
    except ChildProcessError:
        ended[None] = 0
    return ended


def _spawn(arguments: list[str]) -> int:
    """Start the program as leader of a new session and process group; return its process ID."""
    pid = os.fork()
    if pid:
        return pid
    try:
        os.setsid()
        os.dup2(os.open(os.devnull, os.O_RDONLY), COMMANDS)
        for number in (signal.SIGHUP, signal.SIGINT, signal.SIGTERM, signal.SIGPIPE, signal.SIGXFSZ):
            signal.signal(number, signal.SIG_DFL)  # otherwise the program would inherit the ignored signal
        _yield_to_the_trainer()
        os.execv(arguments[0], arguments)  # noqa: S606 - the sidecar's own command line
    except OSError as error:
        _report(f"error {error.errno}")
    os._exit(_NOT_RUN)


def _yield_to_the_trainer() -> None:
    """Set a scheduling policy with which the simulator does not preempt a trainer on the same processor.

    A trainer sends requests to its simulators, one after another. With the default policy, the kernel
    interrupts the trainer at nearly each request, to run the simulator that gets the request.
    """
    with contextlib.suppress(OSError):  # this call is optional, because a sandbox may refuse it
        os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))


def _report(line: str) -> None:
    """Send a line to the sidecar; do nothing if the sidecar has ended."""
    with contextlib.suppress(BrokenPipeError):
        os.write(REPORTS, f"{line}\n".encode())


if __name__ == "__main__":
    main()
