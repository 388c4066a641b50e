"""Start programs, each in a session of its own, and wait for them without blocking.

Only this module starts processes of a pod. A Ctrl-C in the terminal reaches only the runner, because the
started processes are not in the runner's process group.
"""

import asyncio
import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from threading import Thread
from typing import Self

from palaestra.local import orphan_killer

NOT_RUNNABLE = 127  # the exit code of a shell for a program that does not exist


class Process:
    """One running program, from start to end."""

    def __init__(self, started: "subprocess.Popen[bytes]") -> None:
        self._started = started
        self._loop = asyncio.get_running_loop()
        self._ended: asyncio.Future[int] = self._loop.create_future()
        when_ended(started.pid, self._report)

    @classmethod
    def start(
        cls,
        command: Sequence[str],
        env: Mapping[str, str],
        *,
        stdout: int,
        stderr: int,
        stdin: int = subprocess.DEVNULL,
    ) -> Self:
        """Start `command` with exactly the variables in `env`; the caller must close its own descriptors.

        Raises:
            OSError: the program cannot be run.
        """
        return cls(
            subprocess.Popen(
                command,
                env=env,
                stdin=stdin,
                stdout=stdout,
                stderr=stderr,
                start_new_session=True,
            )
        )

    @property
    def pid(self) -> int:
        """Return the process id, which is also the id of the process's session and group."""
        return self._started.pid

    async def wait(self) -> int:
        """Return the exit code; as in a container runtime, 128 + n means that signal n ended the program."""
        return await asyncio.shield(self._ended)

    async def ended_within(self, seconds: float) -> bool:
        """Wait at most `seconds`, and return whether the program has ended."""
        await asyncio.wait({self._ended}, timeout=max(seconds, 0.0))
        return self._ended.done()

    def send(self, number: signal.Signals) -> None:
        """Send a signal to the program's first process only; after its end, do nothing."""
        if not self._ended.done():
            self._started.send_signal(number)

    def _report(self) -> None:
        with contextlib.suppress(RuntimeError):  # the event loop is closed, so no task waits for the end
            self._loop.call_soon_threadsafe(self._reap)

    def _reap(self) -> None:
        code = self._started.wait()
        if not self._ended.done():
            self._ended.set_result(code if code >= 0 else 128 - code)


class OrphanKiller:
    """Kills all processes of a pod when `close` is called, or when this process ends."""

    def __init__(self, pod_uid: str) -> None:
        reader, self._writer = os.pipe()
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-I", "-S", str(Path(orphan_killer.__file__)), f"{pod_uid}/"],
                stdin=reader,
                env={},
                start_new_session=True,
            )
        finally:
            os.close(reader)

    def close(self) -> None:
        """Begin to kill all remaining processes of the pod; a second call has no effect."""
        if self._writer >= 0:
            os.close(self._writer)
            self._writer = -1

    async def closed(self) -> None:
        """Call `close`, and wait until all processes of the pod have ended."""
        self.close()
        await asyncio.to_thread(self._process.wait)


def marked(env: Mapping[str, str], pod_uid: str, container: str) -> dict[str, str]:
    """Return the environment of a container: this machine's variables, overridden by `env`, and the marker.

    The folder of this installation's programs is first on the PATH, as in an image.
    """
    machine = {**os.environ, "PATH": program_path()}
    return {**machine, **env, orphan_killer.MARKER: f"{pod_uid}/{container}/"}


def program_path() -> str:
    """Return the PATH of containers: the folder of the running interpreter, then this machine's PATH."""
    return os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)))


async def end_marked(pod_uid: str, container: str) -> None:
    """Kill the remaining processes of a container whose first process has ended."""
    await asyncio.to_thread(orphan_killer.sweep, f"{pod_uid}/{container}/")


def when_ended(pid: int, report: Callable[[], object]) -> None:
    """Call `report` from a thread as soon as a child process has ended; the caller must reap the child.

    `os.pidfd_open` would need no thread. But some systems do not support it: old kernels, Pythons that were
    built for an old kernel, and older container runtimes with a seccomp filter.
    """
    Thread(target=_wait, args=(pid, report), name=f"end of {pid}", daemon=True).start()


def end_descriptor(pid: int) -> int:
    """Return a descriptor that is readable as soon as a child process has ended; the caller closes it."""
    reader, writer = os.pipe()

    def tell() -> None:
        with contextlib.suppress(BrokenPipeError):  # the reading end is closed
            # To close the pipe is not enough, because a forked process may have a copy of the descriptor.
            os.write(writer, b"\n")
        os.close(writer)

    when_ended(pid, tell)
    return reader


def _wait(pid: int, report: Callable[[], object]) -> None:
    with contextlib.suppress(ChildProcessError):  # the child was reaped before
        os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT)
    report()
