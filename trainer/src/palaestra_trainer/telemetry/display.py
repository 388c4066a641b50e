"""The progress of a run for a person: a bar on a terminal, elsewhere a log line every few seconds."""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import Protocol, Self, TextIO

import structlog

from palaestra_protocol.pod.status import TrainerStatus

log = structlog.get_logger(__name__)


class ProgressDisplay(Protocol):
    """Shows a run while it is entered."""

    def __enter__(self) -> Self:
        """Begin to show."""
        ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Stop showing."""
        ...

    @property
    def due(self) -> bool:
        """Whether the display should be updated now; cheap, because it is called at every step."""
        ...

    def show(self, status: TrainerStatus) -> None:
        """Show the progress of the run."""
        ...


class _Paced:
    every_s: float

    def __init__(self) -> None:
        self._next = 0.0

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Do nothing, because nothing is open."""

    @property
    def due(self) -> bool:
        """Whether `every_s` seconds have passed since the last time."""
        return time.monotonic() >= self._next

    def _shown(self) -> None:
        self._next = time.monotonic() + self.every_s


class Lines(_Paced):
    """A log line every few seconds."""

    def __init__(self, every_s: float = 10.0) -> None:
        super().__init__()
        self.every_s = every_s

    def show(self, status: TrainerStatus) -> None:
        """Write one line."""
        log.info(
            "progress",
            step=status.step,
            target=status.target,
            success_rate=status.success_rate,
            mean_return=_rounded(status.mean_return),
            steps_per_second=_rounded(status.steps_per_second),
            faults=_restarts(status),
        )
        self._shown()


class Bar(_Paced):
    """A progress bar, followed by success rate, mean return, speed and faults."""

    every_s = 0.5

    def __init__(self, stream: TextIO | None = None) -> None:
        super().__init__()
        from rich import console, progress  # noqa: PLC0415 - a run without a terminal needs no rich

        self._bar = progress.Progress(
            progress.TextColumn("{task.description}"),
            progress.BarColumn(),
            progress.MofNCompleteColumn(),
            progress.TextColumn("{task.fields[figures]}"),
            progress.TimeRemainingColumn(),
            console=console.Console(file=stream or sys.stderr),
            refresh_per_second=2,
        )
        self._task = self._bar.add_task("starting", total=None, figures="")

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._bar.stop()

    def show(self, status: TrainerStatus) -> None:
        """Move the bar."""
        self._bar.update(
            self._task,
            description=status.phase,
            completed=status.step,
            total=status.target,
            figures=_figures(status),
        )
        self._shown()


def for_stream(stream: TextIO) -> ProgressDisplay:
    """Return a bar for a terminal, lines for anything else."""
    return Bar(stream) if stream.isatty() else Lines()


def _figures(status: TrainerStatus) -> str:
    figures = (
        ("success", None if status.success_rate is None else f"{status.success_rate:.0%}"),
        ("return", _rounded(status.mean_return)),
        ("steps/s", None if status.steps_per_second is None else round(status.steps_per_second)),
        ("faults", _restarts(status)),
    )
    return "  ".join(f"{name} {value}" for name, value in figures if value is not None)


def _restarts(status: TrainerStatus) -> int:
    return sum(simulator.restarts for simulator in status.simulators)


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 2)
