"""Run one attempt of a replica: a pod's containers, from the first start to the last end.

The containers start and stop in the order of KEP-753. The init containers start one after another; the
successor of a sidecar waits for the sidecar's startup probe. Then the main container runs, and its end ends
the pod. Then the sidecars stop in reverse order, within the remaining grace period. `stop` begins this
shutdown early. The main container stops first, so that it can still use its simulators while it writes the
last checkpoint.
"""

import asyncio
import time
from collections.abc import Coroutine, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from palaestra.local.container import BackOff, Running
from palaestra.local.errors import StartFailed
from palaestra.local.output import Log, Show
from palaestra.local.pod_spec import Container, Pod
from palaestra.local.process import OrphanKiller

LONG_S = 10.0  # seconds after which a start is shown as slow; the import of PyTorch takes several seconds
TRIES = 3  # the pod fails if a sidecar ends this many times before it has started


@dataclass(frozen=True, slots=True, kw_only=True)
class Kubelet:
    """The settings for pods on this machine: output and deadlines.

    `show` is called with a line for each container that has not started within `long_s`.
    """

    logs: Mapping[str, Log]  # keys: the names of containers
    backoff: BackOff = field(default_factory=BackOff)
    start_deadline_s: float = 60.0
    show: Show | None = None
    long_s: float = LONG_S
    terminal: int | None = None  # descriptor of the person's terminal, on which the main container may draw


class _Stopped(Exception):
    """`stop` was called before the main container was started."""


class RunningPod:
    """A pod on this machine, before, during and after its run."""

    def __init__(self, pod: Pod, kubelet: Kubelet) -> None:
        self._pod = pod
        self._kubelet = kubelet
        self._stop = asyncio.Event()
        self._watchdog: OrphanKiller | None = None
        self._running: list[Running] = []
        self._tasks: set[asyncio.Task[None]] = set()
        self._end_of_grace: float | None = None

    def stop(self) -> None:
        """Begin the shutdown: the main container first."""
        self._stop.set()

    def kill(self) -> None:
        """Kill every process at once."""
        self._stop.set()
        if self._watchdog is not None:
            self._watchdog.close()

    async def run(self) -> int | None:
        """Run the pod and return the main container's exit code; None if `stop` was called before its start.

        When this returns or raises, no process of the pod is left.

        Raises:
            StartFailed: a sidecar for which other containers wait did not start.
        """
        self._watchdog = OrphanKiller(self._pod.uid)
        try:
            for spec in self._pod.init:
                running = self._add(spec)
                with self._reported(running):
                    await self._unless_stopped(self._bring_up(running))
            return await self._run_main()
        except _Stopped:
            return None
        finally:
            for running in reversed(self._running):
                await running.stop(self._grace_left_s())
            await asyncio.gather(*self._tasks)
            await self._watchdog.closed()

    def _add(self, spec: Container) -> Running:
        kubelet = self._kubelet
        running = Running(spec, self._pod, kubelet.logs[spec.name], kubelet.backoff)
        self._running.append(running)
        return running

    async def _bring_up(self, running: Running) -> None:
        """Start an init container and wait until its successor may start."""
        if not running.spec.sidecar:
            if code := await running.run_once():
                raise StartFailed(_why(running, f"ended with exit code {code}"))
            return
        life = asyncio.create_task(running.keep_running())
        self._tasks.add(life)
        if running.spec.startup is not None:
            await self._until_started(running)

    async def _until_started(self, running: Running) -> None:
        try:
            async with asyncio.timeout(self._kubelet.start_deadline_s):
                if not await running.until_started(TRIES):
                    raise StartFailed(_why(running, f"ended {TRIES} times before it was ready"))
        except TimeoutError:
            seconds = f"{self._kubelet.start_deadline_s:g} s"
            raise StartFailed(_why(running, f"was not ready within {seconds}")) from None

    async def _run_main(self) -> int:
        main = self._add(self._pod.main)
        life = asyncio.create_task(main.run_once(self._kubelet.terminal))
        stop = asyncio.create_task(self._stop.wait())
        with self._reported(main):
            await asyncio.wait({life, stop}, return_when=asyncio.FIRST_COMPLETED)
        if not life.done():
            await main.stop(self._grace_left_s())
        stop.cancel()
        return await life

    @contextmanager
    def _reported(self, running: Running) -> Iterator[None]:
        """If the block takes longer than `long_s`, show that a container has not started, with the time.

        The main container counts as started as soon as it has written a line; it reports later waits itself.
        """
        since = time.strftime("%H:%M:%S")
        main = running.spec is self._pod.main

        def report() -> None:
            if self._kubelet.show is None or (main and running.log.last_lines):
                return
            fact = f"{running.spec.name} has written nothing" if main else f"waits for {running.spec.name}"
            self._kubelet.show(f"{fact} since {since}; see {running.log.path}")

        timer = asyncio.get_running_loop().call_later(self._kubelet.long_s, report)
        try:
            yield
        finally:
            timer.cancel()

    async def _unless_stopped(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.create_task(work)
        stop = asyncio.create_task(self._stop.wait())
        try:
            await asyncio.wait({task, stop}, return_when=asyncio.FIRST_COMPLETED)
            if not task.done():
                raise _Stopped
            task.result()
        finally:
            task.cancel()
            stop.cancel()
            await asyncio.gather(task, stop, return_exceptions=True)

    def _grace_left_s(self) -> float:
        """Return the remaining seconds of the grace period, which begins with the first call."""
        now = asyncio.get_running_loop().time()
        if self._end_of_grace is None:
            self._end_of_grace = now + self._pod.grace_s
        return max(self._end_of_grace - now, 0.0)


def _why(running: Running, fact: str) -> str:
    last = running.log.last_lines[-1:] or ("it wrote nothing",)
    return f"{running.spec.name} {fact}: {last[0].strip()}; see {running.log.path}"
