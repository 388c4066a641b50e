"""The errors of a local run, each with its remedy.

LocalError              one line for a person, and the exit code of `palaestra run`
├── RunRefused          exit 2: a check failed before the start of the run
├── StartFailed         exit 1: a sidecar did not start, so the trainer was not started
├── StillRunning        no exit code: a run in the background has not ended by a deadline
└── StorageFailed       exit 1: the run directory cannot be written (full disk, no permission)
"""

import signal

from palaestra.errors import PalaestraError
from palaestra_protocol.pod.status import ExitCode

KILLED = 128 + signal.SIGINT  # the exit code after a second Ctrl-C


class LocalError(PalaestraError):
    """A problem on this machine stops the run; the message names the problem and the remedy."""

    exit_code = 1


class RunRefused(LocalError, ValueError):
    """The run cannot be started as requested; no process was started and no file was changed."""

    exit_code = int(ExitCode.CONFIGURATION)


class StartFailed(LocalError, RuntimeError):
    """A container for which other containers wait did not start."""


class StorageFailed(LocalError, OSError):
    """A file of the run could not be written; the old files are unchanged."""


class StillRunning(LocalError, TimeoutError):
    """A run in the background did not end within a deadline; the same call may be repeated."""
