"""Report the end of a child process, on every kernel and in every container runtime.

`os.pidfd_open` would need no thread. But old kernels, Pythons that were built for an old kernel, and the
seccomp filters of older container runtimes do not allow it.
"""

import os
from collections.abc import Callable
from contextlib import suppress
from threading import Thread


def when_ended(pid: int, report: Callable[[], object]) -> None:
    """Call `report` from a thread once a child of this process has ended; the caller must still reap it."""
    Thread(target=_wait, args=(pid, report), name=f"end of {pid}", daemon=True).start()


def end_descriptor(pid: int) -> int:
    """Return a descriptor that is readable once a child of this process has ended; the caller closes it."""
    reader, writer = os.pipe()

    def tell() -> None:
        with suppress(BrokenPipeError):  # the reader is closed
            os.write(writer, b"\n")  # a forked process may have a copy, so closing would not suffice
        os.close(writer)

    when_ended(pid, tell)
    return reader


def _wait(pid: int, report: Callable[[], object]) -> None:
    with suppress(ChildProcessError):  # already reaped
        os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT)
    report()
