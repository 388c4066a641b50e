"""Running other programs, each with a deadline; a program is killed if this process dies."""

import subprocess
from collections.abc import Sequence
from pathlib import Path

from tools.images.errors import ImagesError

_LAST_LINES = 15
_DIES_WITH_US = ("setpriv", "--pdeathsig=KILL", "--")


def run(command: Sequence[str], *, log: Path, deadline_s: float) -> None:
    """Run a program with its output in `log`.

    Raises:
        ImagesError: the program failed, or took longer than `deadline_s`; the message ends with the last
            lines of its output.
    """
    log.parent.mkdir(parents=True, exist_ok=True)
    said = _tried(command, log, deadline_s)
    if said is None:
        return
    last = "\n".join(log.read_text(errors="replace").splitlines()[-_LAST_LINES:])
    raise ImagesError(f"{command[0]}: {said}; its whole output is in {log}\n{last}")


def answer(command: Sequence[str], *, deadline_s: float) -> str | None:
    """Return the output of a program, without white space at its end; None if the program fails."""
    try:
        done = subprocess.run(
            [*_DIES_WITH_US, *command],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=deadline_s,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.rstrip()


def _tried(command: Sequence[str], log: Path, deadline_s: float) -> str | None:
    """Run a program and return the error, if there was one."""
    quiet = subprocess.DEVNULL
    try:
        with log.open("wb") as output:
            subprocess.run(
                [*_DIES_WITH_US, *command],
                stdin=quiet,
                stdout=output,
                stderr=output,
                timeout=deadline_s,
                check=True,
            )
    except subprocess.CalledProcessError as error:
        return f"ended with {error.returncode}"
    except subprocess.TimeoutExpired:
        return f"was not done after {deadline_s:.0f} s"
    except OSError as error:
        return f"could not be run: {error.strerror}"
    return None
