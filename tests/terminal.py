"""A user's terminal: shell commands from a page of the documentation, typed as written."""

import os
import signal
import subprocess
from contextlib import suppress
from pathlib import Path


class Terminal:
    """A shell in `folder` that inherits the environment of this process.

    Args:
        folder: the working directory of the commands, and their HOME.
        path: a folder that precedes the others in PATH.
        before: commands that every shell runs first.
        environment: additional variables.
    """

    def __init__(self, folder: Path, *, path: object = "", before: str = "", **environment: str) -> None:
        self._folder = folder
        self._before = before
        self._environment = {**os.environ, "HOME": str(folder), **environment}
        if path:
            self._environment["PATH"] = f"{path}:{os.environ['PATH']}"

    def try_(self, text: str, within_s: float) -> tuple[int, str]:
        """Type commands up to the first one that fails, and return the exit code and all output.

        Raises:
            subprocess.TimeoutExpired: the commands took longer than `within_s`, and were killed.
        """
        with subprocess.Popen(
            ["bash", "-euc", self._before + text],
            cwd=self._folder,
            env=self._environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        ) as shell:
            try:
                printed, _ = shell.communicate(timeout=within_s)
            finally:  # otherwise a program that exceeds the timeout would outlive its shell
                with suppress(ProcessLookupError):
                    os.killpg(shell.pid, signal.SIGKILL)
        return shell.returncode, printed

    def type_in(self, text: str, within_s: float) -> str:
        """Type commands, which must succeed, and return all output."""
        code, printed = self.try_(text, within_s)
        assert code == 0, f"{text}\n{printed}"
        return printed
