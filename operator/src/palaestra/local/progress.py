"""The progress of a run, as the run's trainer reports it at `/status`."""

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from palaestra.local.probe import DIRECT
from palaestra.plan.training import FILE, RunAddresses
from palaestra_protocol.fields import MOST_BYTES, decoded
from palaestra_protocol.pod.enums import FaultKind
from palaestra_protocol.pod.status import SuccessInterval, TrainerStatus

ANSWER_S = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class RunProgress:
    """The newest values of a run; an unknown value is None.

    Attributes:
        phase: first `starting`, then the phase that the trainer reports, and finally `ended`.
        step: environment steps from which the run has learned, over all attempts.
        target: steps at which the run ends; 0 before the trainer's first response.
        steps_per_second: recent environment steps per second.
        success_rate: success rate of the last evaluation, 0 to 1.
        success_interval: the interval around `success_rate`.
        mean_return: mean return of recent training episodes.
        faults: number of faults of all simulators, over all attempts.
    """

    phase: str = "starting"
    step: int = 0
    target: int = 0
    steps_per_second: float | None = None
    success_rate: float | None = None
    success_interval: SuccessInterval | None = None
    mean_return: float | None = None
    faults: int = 0


class ProgressReader:
    """Reads the progress of a run that is about to start."""

    def __init__(self, directory: Path) -> None:
        """Record the time of an earlier run's file, whose addresses may now belong to another program."""
        self._file = directory / FILE
        self._stale = self._written()
        self._last = RunProgress()

    def progress(self) -> RunProgress:
        """Return the newest values; while the trainer does not respond, return the same object again."""
        if (status := self._status()) is not None:
            self._last = RunProgress(
                phase=status.phase,
                step=status.step,
                target=status.target,
                steps_per_second=status.steps_per_second,
                success_rate=status.success_rate,
                success_interval=status.success_interval,
                mean_return=status.mean_return,
                faults=sum(status.faults.values()) - status.faults.get(FaultKind.SLOW, 0),
            )
        return self._last

    def _status(self) -> TrainerStatus | None:
        written = self._written()
        if written is None or written == self._stale:
            return None
        with suppress(OSError, ValueError):
            address = RunAddresses.read(self._file.read_bytes()).status
            with DIRECT.open(f"http://{address}/status", timeout=ANSWER_S) as answer:
                return TrainerStatus.from_json(decoded(answer.read(MOST_BYTES)))
        return None  # the trainer has not started yet, has ended, or is between two attempts

    def _written(self) -> int | None:
        try:
            return self._file.stat().st_mtime_ns
        except OSError:
            return None
