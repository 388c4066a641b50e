"""An operator that restarts whenever it dies, as a kubelet restarts a container."""

import threading
from pathlib import Path
from typing import Any, Self

from tests.integration.operator.operators import RunningOperator

UNFORESEEN = "exception"  # the field of a log line that contains a traceback


class AttendedOperator:
    """An operator process that runs until the block ends and restarts whenever it dies.

    Args:
        kubeconfig: the kubeconfig of the operator.
        folder: the folder of the operator's logs.
        options: further options for the command line.
    """

    def __init__(self, kubeconfig: Path, folder: Path, *options: str) -> None:
        self._kubeconfig = kubeconfig
        self._folder = folder
        self._options = options
        self._started: list[RunningOperator] = []
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._attend, daemon=True)

    @property
    def lives(self) -> int:
        """The number of times that the operator was started."""
        return len(self._started)

    def kill(self) -> None:
        """Kill the operator, and return when it is dead; another thread restarts it at once."""
        self._started[-1].kill()

    def unforeseen(self) -> list[dict[str, Any]]:
        """Return the log lines that contain a traceback."""
        return [line for each in self._started for line in each.lines() if UNFORESEEN in line]

    def __enter__(self) -> Self:
        self._start()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ending.set()
        self._started[-1].kill()
        self._thread.join()
        self._started[-1].kill()  # the other thread may have restarted it meanwhile

    def _start(self) -> None:
        log = self._folder / f"operator-{len(self._started)}.log"
        self._started.append(RunningOperator(self._kubeconfig, log, *self._options))

    def _attend(self) -> None:
        while not self._ending.is_set():
            self._started[-1].process.wait()
            if not self._ending.is_set():
                self._start()
