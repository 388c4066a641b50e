"""Pods of small shell scripts, and functions that observe their processes."""

import asyncio
import os
import shlex
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from palaestra.local.container import BackOff
from palaestra.local.orphan_killer import MARKER
from palaestra.local.output import Log
from palaestra.local.pod import Kubelet, RunningPod
from palaestra.local.pod_spec import Container, Pod

PATIENCE_S = 20.0  # the waits take milliseconds on an idle machine


def alive(pod_uid: str) -> list[int]:
    """Return the ids of processes that have the marker of a pod in their environment."""
    wanted = f"{MARKER}={pod_uid}/".encode()
    found = []
    for entry in os.scandir("/proc"):
        try:
            environment = Path(f"/proc/{int(entry.name)}/environ").read_bytes()
        except (OSError, ValueError):
            continue
        if any(mark.startswith(wanted) for mark in environment.split(b"\0")):
            found.append(int(entry.name))
    return found


def _eventually(claim: Callable[[], object]) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not claim():
        assert time.monotonic() < deadline, f"{claim} never held"
        time.sleep(0.01)


@pytest.fixture
def eventually() -> Callable[[Callable[[], object]], None]:
    """Return a function that waits until a claim is true, and fails after `PATIENCE_S`."""
    return _eventually


@dataclass
class Stage:
    """The surroundings of one pod: its folder, events, logs and containers."""

    folder: Path
    opened: ExitStack
    uid: str = field(default_factory=lambda: str(uuid.uuid4()))
    start_deadline_s: float = PATIENCE_S
    long_s: float = PATIENCE_S
    shown: list[str] = field(default_factory=list)
    logs: dict[str, Log] = field(default_factory=dict)

    @property
    def events(self) -> list[str]:
        """Return the lines that the containers have written with `event`, in order."""
        file = self.folder / "events"
        return file.read_text().splitlines() if file.exists() else []

    def container(self, name: str, script: str, **options: object) -> Container:
        """Return a container that runs a bash script, in which `event x` writes the line `<name> x`."""
        events = shlex.quote(str(self.folder / "events"))
        helper = f'event() {{ echo "{name} $1" >> {events}; }}\n'
        fields = {"env": {}, "sidecar": name != "main", **options}
        return Container(name=name, command=("bash", "-c", helper + script), **fields)  # type: ignore[arg-type]

    def sidecar(self, name: str, **options: object) -> Container:
        """Return a sidecar that writes its start and its end as events, and ends on SIGTERM."""
        script = "trap 'event stop; exit 0' TERM; event start; while :; do sleep 0.02; done"
        return self.container(name, script, **options)

    def pod(self, *init: Container, main: str, grace_s: float = PATIENCE_S) -> RunningPod:
        """Return a pod with these containers, which has not been started."""
        pod = Pod(
            uid=self.uid,
            init=init,
            main=self.container("main", main),
            grace_s=grace_s,
            mounts={},
        )
        self.logs = {each.name: self.log(each.name) for each in pod.containers}
        backoff = BackOff(first_s=0.02, most_s=0.2, calm_s=PATIENCE_S)
        return RunningPod(
            pod,
            Kubelet(
                logs=self.logs,
                backoff=backoff,
                start_deadline_s=self.start_deadline_s,
                show=self.shown.append,
                long_s=self.long_s,
            ),
        )

    def interrupt(
        self, event: str, *init: Container, main: str, grace_s: float = PATIENCE_S, kill: bool = False
    ) -> int | None:
        """Run a pod, stop it after an event, kill it if `kill`, and return the main exit code."""

        async def run() -> int | None:
            pod = self.pod(*init, main=main, grace_s=grace_s)
            running = asyncio.create_task(pod.run())
            await asyncio.to_thread(_eventually, lambda: event in self.events)
            pod.stop()
            if kill:
                pod.kill()
            return await running

        return asyncio.run(asyncio.wait_for(run(), PATIENCE_S * 2))

    def log(self, name: str) -> Log:
        """Return a log that is closed at the end of the test."""
        log = Log(name, self.folder / "logs", None)
        self.opened.callback(log.close)
        return log

    def run(self, *init: Container, main: str, grace_s: float = PATIENCE_S) -> int | None:
        """Run a pod to its end and return the main container's exit code."""
        pod = self.pod(*init, main=main, grace_s=grace_s)
        return asyncio.run(asyncio.wait_for(pod.run(), PATIENCE_S * 2))


@pytest.fixture
def stage(tmp_path: Path) -> Iterator[Stage]:
    """Yield a stage for a pod; after the test, no process of the pod may exist."""
    with ExitStack() as opened:
        yield (stage := Stage(folder=tmp_path, opened=opened))
        assert alive(stage.uid) == []
