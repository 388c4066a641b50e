"""An operator that is restarted when it dies, as a kubelet does with its container."""

import threading
from pathlib import Path
from typing import Any, Self

from tests.integration.operator.operators import RunningOperator

UNFORESEEN = "exception"  # the field of a log line that has a traceback


class AttendedOperator:
    """An operator process until the block ends, which is started again whenever it dies.

    Args:
        kubeconfig: its kubeconfig.
        folder: for its logs.
        options: further options of its command line.
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
        """The number of starts."""
        return len(self._started)

    def kill(self) -> None:
        """Kill it, and return when it is dead; it is started again at once."""
        self._started[-1].kill()

    def unforeseen(self) -> list[dict[str, Any]]:
        """Return the log lines that have a traceback."""
        return [line for each in self._started for line in each.lines() if UNFORESEEN in line]

    def __enter__(self) -> Self:
        self._start()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ending.set()
        self._started[-1].kill()
        self._thread.join()
        self._started[-1].kill()  # a restart may have started it meanwhile

    def _start(self) -> None:
        log = self._folder / f"operator-{len(self._started)}.log"
        self._started.append(RunningOperator(self._kubeconfig, log, *self._options))

    def _attend(self) -> None:
        while not self._ending.is_set():
            self._started[-1].process.wait()
            if not self._ending.is_set():
                self._start()
