"""The errors of a local run, each with its remedy.

LocalError              one line for a person, and the exit code of `palaestra run`
├── Refused             exit 2: found before anything was started
├── StartFailed         exit 1: a sidecar did not come up, so the trainer was not started
├── StillRunning        no exit code: a run in the background has not ended by a deadline
└── StorageFailed       exit 1: the run directory cannot be written (full disk, no permission)
"""

import signal

from palaestra.errors import PalaestraError
from palaestra_protocol.pod.status import ExitCode

KILLED = 128 + signal.SIGINT  # the exit code after a second Ctrl-C


class LocalError(PalaestraError):
    """A cause on this machine stops the run; the message names it and the remedy."""

    exit_code = 1


class RunRefused(LocalError, ValueError):
    """The run cannot be started as asked; nothing was started and nothing was changed."""

    exit_code = int(ExitCode.CONFIGURATION)


class StartFailed(LocalError, RuntimeError):
    """A container for which others wait did not start."""


class StorageFailed(LocalError, OSError):
    """A file of the run could not be written; what was there before is unharmed."""


class StillRunning(LocalError, TimeoutError):
    """A run in the background has not ended by a deadline; the same call may be repeated."""
