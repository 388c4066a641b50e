"""Determine the exit code of a run, and write its termination message.

After the container has ended, the operator can read only these two values.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import structlog

from palaestra_protocol.pod.status import ExitCode, Termination
from palaestra_trainer.errors import (
    CallbackFailed,
    ConfigurationError,
    Diverged,
    FaultBudgetSpent,
    MasterLost,
    SimulatorFault,
    SimulatorHung,
    fact_of,
)
from palaestra_trainer.run.signals import Interrupted

log = structlog.get_logger(__name__)

TERMINATION_VARIABLE = "PALAESTRA_TERMINATION_LOG"
KUBERNETES_LOG = Path("/dev/termination-log")
UNEXPECTED = 1


@dataclass(frozen=True, slots=True)
class End:
    """The end of a run.

    Attributes:
        code: exit code of the process.
        reason: the reason as one word, for programs.
        message: the reason as a sentence, for people.
    """

    code: int
    reason: str
    message: str


# The first row whose class matches the error decides.
ENDS: tuple[tuple[type[BaseException], int, str], ...] = (
    (Interrupted, ExitCode.INTERRUPTED, "Interrupted"),
    (MasterLost, ExitCode.INTERRUPTED, "MasterLost"),
    (ConfigurationError, ExitCode.CONFIGURATION, "ConfigurationWrong"),
    (CallbackFailed, UNEXPECTED, "CallbackFailed"),
    (FaultBudgetSpent, ExitCode.FAULT_BUDGET, "SimulatorBudgetSpent"),
    (Diverged, ExitCode.DIVERGED, "Diverged"),
    (SimulatorHung, ExitCode.STALLED, "SimulatorHung"),
    (SimulatorFault, UNEXPECTED, "SimulatorUnavailable"),
)


def end_of(error: BaseException) -> End:
    """Return exit code, reason and message of a run that an error ended."""
    for kind, code, reason in ENDS:
        if isinstance(error, kind):
            return End(code, reason, str(error))
    if isinstance(error, SystemExit | KeyboardInterrupt):
        fact = "code of the job ended the program, but only the run may end it"
        return End(UNEXPECTED, "ProgramEnded", f"{fact} ({fact_of(error)}); raise an error instead")
    if isinstance(error, OSError) and error.errno in {errno.ENOSPC, errno.EDQUOT}:
        where = error.filename or "the run directory"
        return End(UNEXPECTED, "StorageFull", f"{where}: disk full; free some space")
    return End(UNEXPECTED, "Unexpected", fact_of(error))


def write_last_word(
    word: Termination, environment: Mapping[str, str] = os.environ, default: Path = KUBERNETES_LOG
) -> None:
    """Write the termination message to the file PALAESTRA_TERMINATION_LOG, or to Kubernetes' file.

    Outside Kubernetes the default file does not exist, and this function does not create it.
    """
    chosen = environment.get(TERMINATION_VARIABLE)
    if chosen is None and not default.exists():
        return
    path = Path(chosen) if chosen else default
    try:
        path.write_text(word.to_message(), encoding="utf-8")
    except OSError as error:
        log.warning("termination message not written", path=str(path), fact=error.strerror)
