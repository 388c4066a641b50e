"""The reaper: a program between the sidecar and its simulator; no process of the simulator can outlive them.

It runs once for each start of the simulator, as `python -I -S reaper.py PROGRAM ...`. A pipe from the
sidecar is its standard input, and a pipe to the sidecar is its descriptor 3:

    in   T             send SIGTERM to the simulator's process group
         K, or EOF     kill everything; EOF also arrives when the sidecar was killed with SIGKILL
    out  started PID   the simulator's first process
         error ERRNO   its program could not be run
         exit STATUS   it ended, with this wait status, and so did all of its descendants

It is a subreaper: a descendant that loses its parent becomes its child, even after `setsid`, a double
fork or a change of environment. A process group, a parent-death signal or a marker in the environment would
lose such a process. So the reaper kills its children until none is left. Each killed parent hands over its
own children before its end is visible (Linux: exit_notify). That needs no timer: SIGCHLD triggers the next
search.

It uses Linux and the standard library only, and imports nothing from this package: it is started as a file.
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
_GIVE_UP_S = 20.0  # a process that outlives SIGKILL for this long hangs in the kernel
_NOT_RUN = 127  # the exit code of a shell that finds no program
_PARENT = 1  # index among the fields after the name in /proc/PID/stat: state, parent, ...


def adopt_orphans() -> None:
    """Make this process the parent of every orphan among its descendants.

    Raises:
        OSError: the kernel refuses.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0) != 0:
        raise OSError(ctypes.get_errno(), "prctl(PR_SET_CHILD_SUBREAPER)")


def children(parents: set[int]) -> set[int]:
    """Return the processes whose parent is one of `parents`, from one pass over /proc."""
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
    """Send SIGKILL to every child of this process that is not `spared`, and return them.

    The kill cannot hit another process: the number stays in use until this process reaps it.
    """
    found = children({os.getpid()}) - spared
    for pid in found:
        with contextlib.suppress(OSError):  # it runs as another user now, who must end it
            os.kill(pid, signal.SIGKILL)
    return found


def main() -> None:
    """Start the program in `argv`, run the commands, and return when none of its processes is left."""
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
    """Return the wait status of `pid` after it and all of its descendants have ended."""
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
    """Run one command of the sidecar for `pid`, which is not reaped yet; return whether to kill."""
    command = os.read(COMMANDS, 1)
    if command == TERMINATE:
        with contextlib.suppress(ProcessLookupError):  # it does not have a group yet
            os.killpg(pid, signal.SIGTERM)
    return command != TERMINATE


def _reap() -> dict[int | None, int]:
    """Return the wait status of every child that has ended; the key None means that no child is left."""
    ended: dict[int | None, int] = {}
    try:
        while (result := os.waitpid(-1, os.WNOHANG))[0]:
            ended[result[0]] = result[1]
    except ChildProcessError:
        ended[None] = 0
    return ended


def _spawn(arguments: list[str]) -> int:
    """Start the program as leader of a new session and group; return its process id."""
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
    """Set a scheduling policy with which the program does not preempt a trainer on the same processor.

    A trainer wakes its simulators one after another by requests. Without this, a woken simulator preempted
    the trainer at nearly each request.
    """
    with contextlib.suppress(OSError):  # optional, because sandboxes may refuse it
        os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))


def _report(line: str) -> None:
    """Report to the sidecar, if it still runs."""
    with contextlib.suppress(BrokenPipeError):
        os.write(REPORTS, f"{line}\n".encode())


if __name__ == "__main__":
    main()
