"""A person's terminal: shell commands of a page of the documentation, typed as they stand."""

import os
import subprocess
from pathlib import Path


class Terminal:
    """A shell in `folder`, with the rest of the environment as here.

    Args:
        folder: where commands are typed; its HOME too.
        path: a folder whose programs come first.
        before: commands that each shell begins with.
        environment: more variables.
    """

    def __init__(self, folder: Path, *, path: object = "", before: str = "", **environment: str) -> None:
        self._folder = folder
        self._before = before
        self._environment = {**os.environ, "HOME": str(folder), **environment}
        if path:
            self._environment["PATH"] = f"{path}:{os.environ['PATH']}"

    def try_(self, text: str, within_s: float) -> tuple[int, str]:
        """Type commands, up to the first that fails; return the exit code and all that they print."""
        done = subprocess.run(
            ["bash", "-euc", self._before + text],
            cwd=self._folder,
            env=self._environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=within_s,
            check=False,
        )
        return done.returncode, done.stdout

    def type_in(self, text: str, within_s: float) -> str:
        """Type commands, which must succeed; return all that they print."""
        code, printed = self.try_(text, within_s)
        assert code == 0, f"{text}\n{printed}"
        return printed
