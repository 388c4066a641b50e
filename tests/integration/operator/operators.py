"""Operators as processes with the permissions of an installation; a test may end them in any way."""

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
    """One operator process, with its log in a file.

    Args:
        kubeconfig: the kubeconfig of the user whose permissions the operator has.
        log: the file of the log.
        options: further options of the command line.
        dies_after: the number of writes after which the operator kills itself.
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
        """Return the log's complete lines, without a last line that is still being written."""
        return whole_lines(self._log)

    def said(self, event: str) -> list[dict[str, Any]]:
        """Return the log lines with this message."""
        return [line for line in self.lines() if line["event"] == event]

    def ask(self, path: str) -> str:
        """Return the operator's response on its port for metrics and probes."""
        [started] = eventually(lambda: self.said("started"))
        with urllib.request.urlopen(f"http://{started['address']}{path}", timeout=END_S) as answer:
            return answer.read().decode()

    def wait(self, deadline_s: float = END_S) -> int:
        """Wait for the end of the operator, and return the exit code."""
        return self.process.wait(deadline_s)

    def stop(self) -> int:
        """End the operator with SIGTERM, as Kubernetes does, and return the exit code."""
        self.process.send_signal(signal.SIGTERM)
        return self.wait()

    def kill(self) -> None:
        """Kill the operator, as a power failure does."""
        self.process.kill()
        self.process.wait(END_S)
