"""End every process of a pod when the runner ends, for any reason.

This module is a separate program, and one process of it runs for each pod. Its standard input is a pipe whose
other end only the runner has. So the pipe closes when the runner ends or closes the pod. The program ignores
the signals of a terminal.

A marker in the environment identifies a pod's processes. Grandchildren inherit the marker through `setsid`,
double forks and new process groups. A parent-death signal or a signal to a process group would miss these
grandchildren. Between its fork and its exec, a child of the runner has no marker yet. But the child keeps the
pipe open, so the program waits for the child.

The reaper of a sidecar works in another way. The reaper is the parent of a simulator's processes, so it needs
no marker and also finds processes that change their environment. This program cannot be the parent, because
the runner itself starts and restarts the processes of a pod.

The program imports only the standard library, because it is started as a file, with `python -I -S`.
"""

import contextlib
import os
import signal
import sys
import time

MARKER = "PALAESTRA_LOCAL_CONTAINER"  # environment variable with the value <pod uid>/<container>/
# The search ends after this number of consecutive rounds that find no process. One round is not enough,
# because it may miss a process during its exec.
QUIET_ROUNDS = 3
ROUND_S = 0.02
DEADLINE_S = 20.0  # a process that survives SIGKILL for this long hangs in the kernel


def kill_marked(prefix: str) -> int:
    """Send SIGKILL to every process whose marker begins with `prefix`; return the number of processes.

    `prefix` is `<pod uid>/` for a whole pod, or `<pod uid>/<container>/` for one container.
    """
    wanted = f"{MARKER}={prefix}".encode()
    with os.scandir("/proc") as entries:
        return sum(_kill_if_marked(int(entry.name), wanted) for entry in entries if entry.name.isdigit())


def _kill_if_marked(pid: int, wanted: bytes) -> bool:
    """Kill `pid` if its marker matches; a handle prevents that a reused pid is killed.

    The handle is opened before the environment is read. Without a handle, another process could get the pid
    in the microseconds after the environment was read.
    """
    with contextlib.suppress(OSError):  # the process has ended, or belongs to another user
        handle = _handle(pid)
        try:
            with open(f"/proc/{pid}/environ", "rb") as file:
                marks = file.read().split(b"\0")
            if any(mark.startswith(wanted) for mark in marks):
                _kill(pid, handle)
                return True
        finally:
            if handle is not None:
                os.close(handle)
    return False


def _handle(pid: int) -> int | None:
    """Return a handle by which `pid` can be killed.

    The result is None if the kernel or Python is too old for handles, or the container runtime forbids them.
    """
    with contextlib.suppress(AttributeError, OSError):
        handle = os.pidfd_open(pid)
        try:
            signal.pidfd_send_signal(handle, 0)
        except (AttributeError, OSError):
            os.close(handle)
            raise
        return handle
    return None


def _kill(pid: int, handle: int | None) -> None:
    if handle is None:
        os.kill(pid, signal.SIGKILL)
    else:
        signal.pidfd_send_signal(handle, signal.SIGKILL)


def sweep(prefix: str) -> None:
    """Kill marked processes until `QUIET_ROUNDS` rounds in a row find no process, or until the deadline."""
    deadline = time.monotonic() + DEADLINE_S
    quiet = 0
    while quiet < QUIET_ROUNDS and time.monotonic() < deadline:
        quiet = 0 if kill_marked(prefix) else quiet + 1
        time.sleep(ROUND_S)  # the kernel needs this time to end the killed processes; /proc has no events


def main() -> None:
    """Wait for the end of standard input, then sweep; `argv[1]` is the prefix of the markers."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    while os.read(0, 64):
        pass
    sweep(sys.argv[1])


if __name__ == "__main__":
    main()
