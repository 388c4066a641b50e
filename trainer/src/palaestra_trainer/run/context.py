"""The objects of one attempt that the modules of the training loop share."""

from __future__ import annotations

from dataclasses import dataclass

from palaestra_trainer.job.configuration import Configuration
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.run.signals import Interruption
from palaestra_trainer.run.telemetry.progress import Progress
from palaestra_trainer.simulators.fleet import Fleet


@dataclass(frozen=True, slots=True, kw_only=True)
class RunContext:
    """The objects of one attempt, whose simulators are up.

    Attributes:
        configuration: the configuration of the run.
        directory: the run directory.
        fleet: all simulators of the run.
        progress: the progress of the run.
        interruption: the check that raises Interrupted after a signal has arrived.
    """

    configuration: Configuration
    directory: RunDirectory
    fleet: Fleet
    progress: Progress
    interruption: Interruption
