"""One control plane for all pytest processes of a run; the first process that needs it starts it.

The control plane, with Palaestra installed, runs in a separate process: `python -m tests.control_plane.shared
FOLDER OWNER`. This process ends and removes the folder after a call of `end`, or when the process OWNER
(pytest) has ended in any way. Each test has its own namespace. A test that stops a control plane, fills it or
changes the definition of TrainingJobs starts a control plane of its own (`plane.running`).
"""

import fcntl
import json
import os
import select
import shutil
import signal
import sys
import tempfile
import threading
import time
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from tests.control_plane.certificates import Authority
from tests.control_plane.installing import install
from tests.control_plane.plane import ControlPlane, DidNotStart, running
from tests.control_plane.programs import programs

ROOT = Path(__file__).parents[2]
KINDS = ROOT / "manifests" / "crd.yaml"
# The request rate of each controller. By default, all controllers share 20 requests per second, so the tests
# of four processes would wait.
REQUESTS_PER_S = 200
ENDS_S = 30.0
VARIABLE = "PALAESTRA_TESTS_CONTROL_PLANE"  # contains the process and the folder of the run
ADDRESS = "plane.json"  # this file is written when the control plane is ready


@dataclass(frozen=True, slots=True)
class Run:
    """One run of pytest: its process, and the folder of its control plane; the folder may not exist yet."""

    owner: int
    folder: Path

    @classmethod
    def of_this_process(cls) -> Self:
        """Return the run of this worker process, or start a run that worker processes inherit."""
        owner, _, folder = os.environ.get(VARIABLE, "").partition(":")
        if owner == str(os.getppid()):
            return cls(os.getppid(), Path(folder))
        begun = cls(os.getpid(), Path(tempfile.gettempdir(), f"control-plane-{os.getpid()}-{time.time_ns()}"))
        os.environ[VARIABLE] = f"{begun.owner}:{begun.folder}"
        return begun


def joined(run: Run, clients: Path) -> ControlPlane:
    """Return the control plane of a run; start it if no process has started it.

    Args:
        run: the same value in all processes of the run.
        clients: an existing folder of this process, see `ControlPlane`.

    Raises:
        NoPrograms: the programs are not built.
        DidNotStart: the control plane did not start.
    """
    binaries = programs()
    run.folder.mkdir(exist_ok=True)
    address = run.folder / ADDRESS
    with (run.folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not address.exists():
            _start(run)
    plane = run.folder / "plane"
    return ControlPlane(
        folder=plane,
        port=json.loads(address.read_text())["port"],
        authority=Authority(plane),
        kubeconfig=plane / "kubeconfig",
        binaries=binaries,
        clients=clients,
    )


def end(run: Run) -> None:
    """End the control plane of a run that this process started, and wait for the end of its processes."""
    address = run.folder / ADDRESS
    if run.owner != os.getpid() or not address.exists():
        return
    restarter = os.pidfd_open(json.loads(address.read_text())["process"])
    signal.pidfd_send_signal(restarter, signal.SIGTERM)
    select.select([restarter], [], [], ENDS_S)
    os.close(restarter)


def _start(run: Run) -> None:
    """Start the process that runs the control plane, and return when the control plane is ready.

    The process may outlive this process, but not the owner of the run.
    """
    command = [sys.executable, "-m", "tests.control_plane.shared", str(run.folder), str(run.owner)]
    ready, written = os.pipe()
    with tempfile.TemporaryFile("w+") as log:
        os.posix_spawn(
            sys.executable,
            command,
            os.environ | {"PYTHONPATH": str(ROOT)},
            file_actions=[
                (os.POSIX_SPAWN_OPEN, 0, os.devnull, os.O_RDONLY, 0),
                (os.POSIX_SPAWN_DUP2, written, 1),
                (os.POSIX_SPAWN_DUP2, log.fileno(), 2),
            ],
            setsid=True,  # Ctrl-C reaches the tests first, which then end the control plane
        )
        os.close(written)
        with os.fdopen(ready) as lines:
            if not lines.readline():  # the process has ended; all its waits have timeouts
                log.seek(0)
                raise DidNotStart(log.read()[-3000:])


def main(folder: Path, owner: int) -> int:
    """Run the control plane in `folder` until SIGTERM or the end of the process `owner`."""
    signal.signal(signal.SIGTERM, _leave)
    threading.Thread(target=_follow, args=(owner,), daemon=True).start()
    with ExitStack() as stack:
        stack.callback(shutil.rmtree, folder)
        (folder / "plane").mkdir(exist_ok=True)
        plane = stack.enter_context(running(folder / "plane", kinds=KINDS, requests_per_s=REQUESTS_PER_S))
        install(plane).close()
        part = folder / f"{ADDRESS}.part"
        part.write_text(json.dumps({"port": plane.port, "process": os.getpid()}))
        part.rename(folder / ADDRESS)
        sys.stdout.write("ready\n")
        sys.stdout.flush()
        signal.pause()
    return 0


def _leave(*_: object) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # a second signal must not interrupt the cleanup
    raise SystemExit(0)


def _follow(owner: int) -> None:
    select.select([os.pidfd_open(owner)], [], [])
    os.kill(os.getpid(), signal.SIGTERM)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), int(sys.argv[2])))
