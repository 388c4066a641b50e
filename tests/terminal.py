"""A user's terminal: shell commands from a page of the documentation, typed as written."""

import os
import signal
import subprocess
from contextlib import suppress
from pathlib import Path


class Terminal:
    """A shell in `folder`, with the rest of the environment as here.

    Args:
        folder: where commands are typed; also its HOME.
        path: a folder whose programs come first.
        before: commands at the beginning of each shell.
        environment: more variables.
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
            subprocess.TimeoutExpired: they took longer than `within_s`, and were killed.
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
            finally:  # otherwise a program that takes too long would continue without its shell
                with suppress(ProcessLookupError):
                    os.killpg(shell.pid, signal.SIGKILL)
        return shell.returncode, printed

    def type_in(self, text: str, within_s: float) -> str:
        """Type commands, which must succeed, and return all output."""
        code, printed = self.try_(text, within_s)
        assert code == 0, f"{text}\n{printed}"
        return printed
