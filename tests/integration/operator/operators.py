"""Operators as processes with the permissions of an installation, which tests end in any way."""

import signal
import subprocess
import sys
import urllib.request
from pathlib import Path
from typing import Any

from tests.json_lines import whole_lines
from tests.waiting import eventually

PROGRAM = Path(__file__).with_name("mortal.py")
END_S = 10.0


class RunningOperator:
    """One operator; its log lines are in a file.

    Args:
        kubeconfig: contains the user with whose permissions it runs.
        log: the file for its log lines.
        options: further options of the command line.
        dies_after: it kills itself with SIGKILL after the responses to this many writes.
    """

    def __init__(self, kubeconfig: Path, log: Path, *options: str, dies_after: int | None = None) -> None:
        self._log = log
        with log.open("ab") as stderr:
            self.process = subprocess.Popen(
                [
                    sys.executable,
                    str(PROGRAM),
                    str(dies_after or 0),
                    "operator",
                    f"--kubeconfig={kubeconfig}",
                    "--metrics-address=127.0.0.1:0",
                    *options,
                ],
                stderr=stderr,
                stdin=subprocess.DEVNULL,
            )

    def lines(self) -> list[dict[str, Any]]:
        """Return its complete log lines, without one that is still being written."""
        return whole_lines(self._log)

    def said(self, event: str) -> list[dict[str, Any]]:
        """Return its log lines with the given message."""
        return [line for line in self.lines() if line["event"] == event]

    def ask(self, path: str) -> str:
        """Return its response on its own port."""
        [started] = eventually(lambda: self.said("started"))
        with urllib.request.urlopen(f"http://{started['address']}{path}", timeout=END_S) as answer:
            return answer.read().decode()

    def wait(self, deadline_s: float = END_S) -> int:
        """Return its exit code once it has ended."""
        return self.process.wait(deadline_s)

    def stop(self) -> int:
        """End it as Kubernetes does, and return its exit code."""
        self.process.send_signal(signal.SIGTERM)
        return self.wait()

    def kill(self) -> None:
        """End it as a power failure does."""
        self.process.kill()
        self.process.wait(END_S)
