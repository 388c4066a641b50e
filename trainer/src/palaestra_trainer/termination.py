"""How a run ends: which exit code stands for which end, and its last word.

The operator reads both, and nothing else, once the container is gone.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import structlog

from palaestra_sim.protocol.status import ExitCode, Termination
from palaestra_trainer.errors import (
    ConfigurationError,
    Diverged,
    FaultBudgetSpent,
    MasterLost,
    SimulatorFault,
    SimulatorHung,
)
from palaestra_trainer.interruption import Interrupted

log = structlog.get_logger(__name__)

TERMINATION_VARIABLE = "PALAESTRA_TERMINATION_LOG"
KUBERNETES_LOG = Path("/dev/termination-log")
UNEXPECTED = 1


@dataclass(frozen=True, slots=True)
class End:
    """How a run ended.

    Attributes:
        code: exit code of the process.
        reason: in one word, for programs.
        message: in a sentence, for people.
    """

    code: int
    reason: str
    message: str


# The first that fits counts.
ENDS: tuple[tuple[type[BaseException], int, str], ...] = (
    (Interrupted, ExitCode.INTERRUPTED, "Interrupted"),
    (MasterLost, ExitCode.INTERRUPTED, "MasterLost"),
    (ConfigurationError, ExitCode.CONFIGURATION, "ConfigurationWrong"),
    (FaultBudgetSpent, ExitCode.FAULT_BUDGET, "SimulatorBudgetSpent"),
    (Diverged, ExitCode.DIVERGED, "Diverged"),
    (SimulatorHung, ExitCode.STALLED, "SimulatorHung"),
    (SimulatorFault, UNEXPECTED, "SimulatorUnavailable"),
)


def end_of(error: BaseException) -> End:
    """Return what an error that ended a run means."""
    for kind, code, reason in ENDS:
        if isinstance(error, kind):
            return End(code, reason, str(error))
    if isinstance(error, OSError) and error.errno in {errno.ENOSPC, errno.EDQUOT}:
        where = error.filename or "the run directory"
        return End(UNEXPECTED, "StorageFull", f"{where}: disk full; free some space")
    return End(UNEXPECTED, "Unexpected", f"{type(error).__name__}: {error}")


def write_last_word(
    word: Termination, environment: Mapping[str, str] = os.environ, default: Path = KUBERNETES_LOG
) -> None:
    """Write the termination message where PALAESTRA_TERMINATION_LOG or Kubernetes wants it.

    Outside of Kubernetes there is no default file, and none is made.
    """
    chosen = environment.get(TERMINATION_VARIABLE)
    if chosen is None and not default.exists():
        return
    path = Path(chosen) if chosen else default
    try:
        path.write_text(word.to_message(), encoding="utf-8")
    except OSError as error:
        log.warning("termination message not written", path=str(path), fact=error.strerror)
