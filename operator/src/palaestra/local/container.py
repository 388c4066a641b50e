"""Run one container as a process: start, probes, restarts with back-off, and a stop within a grace period.

The rules are those of the kubelet. SIGTERM goes only to the first process, and SIGKILL to all processes of
the container. The wait before a restart doubles each time, and is reset after a long run.
"""

import asyncio
import contextlib
import os
import signal
from dataclasses import dataclass

from palaestra.local import probe
from palaestra.local.output import Log
from palaestra.local.pod_spec import Container, Pod
from palaestra.local.process import NOT_RUNNABLE, Process, end_marked, marked

# Longest wait for output that is still in the pipe; another process may keep the pipe open longer.
DRAIN_S = 0.5
TERMINATED = 128 + signal.SIGTERM


@dataclass(frozen=True, slots=True, kw_only=True)
class BackOff:
    """The waits of a container before its restarts, by the kubelet's rule, but with shorter times.

    The wait doubles with each end, from `first_s` to `most_s`. A run longer than `calm_s` resets the wait.
    """

    first_s: float = 0.5
    most_s: float = 30.0
    calm_s: float = 60.0

    def wait_s(self, ends_in_a_row: int) -> float:
        """Return the seconds to wait after `ends_in_a_row` consecutive ends, 1 or more."""
        return float(min(self.first_s * 2 ** (ends_in_a_row - 1), self.most_s))


class Running:
    """One container of a running pod, including its restarts."""

    def __init__(self, spec: Container, pod: Pod, log: Log, backoff: BackOff) -> None:
        self.spec = spec
        self.log = log
        self.ends = 0
        self.started = False  # True once the startup probe has passed; without a probe, from the start
        self._news = asyncio.Event()  # set when the container has started or ended
        self._pod = pod
        self._env = marked(spec.env, pod.uid, spec.name)
        self._backoff = backoff
        self._stopping = asyncio.Event()
        self._process: Process | None = None

    async def run_once(self, terminal: int | None = None) -> int:
        """Run the container once and return the exit code.

        `terminal` is the descriptor of a terminal on which the container may draw.
        """
        if self._stopping.is_set():
            return TERMINATED
        process = self._process = self._start(terminal)
        if process is None:
            return NOT_RUNNABLE
        watch = asyncio.create_task(self._watch(process))
        try:
            code = await process.wait()
        finally:
            watch.cancel()
            await asyncio.gather(watch, return_exceptions=True)
        await self.log.finished(DRAIN_S)
        self.log.note(f"{self.spec.name} ended with exit code {code}")
        return code

    async def keep_running(self) -> None:
        """Run the container, and restart it until it is stopped, like a native sidecar."""
        ends_in_a_row = 0
        loop = asyncio.get_running_loop()
        while True:
            born = loop.time()
            await self.run_once()
            if self._stopping.is_set():
                return
            self.ends += 1
            self._news.set()
            await end_marked(self._pod.uid, self.spec.name)
            ends_in_a_row = 1 if loop.time() - born > self._backoff.calm_s else ends_in_a_row + 1
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._stopping.wait(), self._backoff.wait_s(ends_in_a_row))

    async def until_started(self, tries: int) -> bool:
        """Return whether the container started within `tries` runs."""
        while not self.started and self.ends < tries:
            self._news.clear()
            await self._news.wait()
        return self.started

    async def stop(self, grace_s: float) -> None:
        """Send SIGTERM and wait for the end; after the grace period, send SIGKILL."""
        self._stopping.set()
        if self._process is not None:
            await self._end(self._process, grace_s)

    def _start(self, terminal: int | None) -> Process | None:
        writer = self.log.begin(terminal)
        try:
            return Process.start(self.spec.command, self._env, stdout=writer, stderr=writer)
        except OSError as error:
            self.log.note(f"{self.spec.command[0]}: {error.strerror}")
            return None
        finally:
            os.close(writer)

    async def _watch(self, process: Process) -> None:
        """Run the startup probe, then the liveness probe; end the process when a probe fails."""
        startup, liveness = self.spec.startup, self.spec.liveness
        if startup is not None and not await probe.until_passed(startup, self._env):
            await self._end_for("startup", process)
            return
        self.started = True
        self._news.set()
        if liveness is not None:
            await probe.until_failed(liveness, self._env)
            await self._end_for("liveness", process)

    async def _end_for(self, failed_probe: str, process: Process) -> None:
        self.log.note(f"{self.spec.name} failed its {failed_probe} probe")
        await self._end(process, self._pod.grace_s)

    async def _end(self, process: Process, grace_s: float) -> None:
        process.send(signal.SIGTERM)
        if not await process.ended_within(grace_s):
            self.log.note(f"{self.spec.name} did not end within {grace_s:.1f} s and is killed")
            process.send(signal.SIGKILL)
        await process.wait()
