"""The picture of a job's progress; `palaestra watch` redraws it each second."""

from datetime import datetime

from rich.console import Group, RenderableType
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from palaestra.api import TrainingJob
from palaestra.api.status import Phase, ReplicaStatus
from palaestra.client import why
from palaestra.view.describe import progress
from palaestra.view.durations import ago
from palaestra.view.history import History, ReplicaFigures
from palaestra.view.sparkline import sparkline

COLOURS = {
    Phase.PENDING: "yellow",
    Phase.RUNNING: "cyan",
    Phase.SUSPENDED: "yellow",
    Phase.SUCCEEDED: "green",
    Phase.FAILED: "red",
}
BAR = 60


def live(job: TrainingJob, history: History, now: datetime) -> Group:
    """Return the drawing of a job; its figures are as old as the status, and ages are relative to `now`."""
    status = job.status
    phase = str(status.phase or "not reconciled by an operator yet")
    heading = Text.assemble((job.metadata.name, "bold"), "  ", (phase, _color(status.phase)))
    heading.append(f"  {status.running} replicas" if status.running else "")
    heading.append(f"  started {ago(status.start_time, now)}" if status.start_time else "")
    parts: list[RenderableType] = [heading, Text(why(status), style="dim")]
    for replica in status.replicas:
        parts += [Text(), *_replica(replica, history.of(replica.index), now)]
    return Group(*parts)


def _replica(
    replica: ReplicaStatus, figures: tuple[ReplicaFigures, ...], now: datetime
) -> list[RenderableType]:
    heading = Text.assemble(f"replica {replica.index}  ", (replica.phase, _color(replica.phase)))
    heading.append(f"  attempt {replica.attempt}" if replica.attempt else "")
    why = ": ".join(part for part in (replica.reason, replica.message) if part)
    parts: list[RenderableType] = [heading]
    if why:
        parts.append(Text(why, style="dim"))
    if replica.step is not None:
        parts += [_bar(replica.step, replica.target), Text(progress(replica))]
    return [*parts, _figures(replica, figures, now)]


def _bar(step: int, target: int | None) -> Table:
    """Return the progress bar as a separate line; empty without a target."""
    line = Table.grid()
    if target:
        line.add_row(ProgressBar(total=target, completed=step, width=BAR, complete_style="cyan"))
    return line


def _figures(replica: ReplicaStatus, figures: tuple[ReplicaFigures, ...], now: datetime) -> Table:
    grid = Table.grid(padding=(0, 2))
    rates = sparkline([figure.steps_per_second for figure in figures], lowest=0.0)
    success = sparkline([figure.success_rate for figure in figures], lowest=0.0, highest=1.0)
    returns = sparkline([figure.mean_return for figure in figures])
    rows = (
        ("success", _shown(replica.success_rate, "{:.0%}"), success),
        ("return", _shown(replica.mean_return, "{:.4g}"), returns),
        ("steps/s", _shown(replica.steps_per_second, "{:.0f}"), rates),
    )
    for name, value, line in rows:
        if value:
            grid.add_row(name, value, Text(line, style="cyan"))
    if replica.last_checkpoint:
        grid.add_row("checkpoint", ago(replica.last_checkpoint.time, now))
    if replica.simulators:
        grid.add_row("simulators", _simulators(replica))
    return grid


def _shown(value: float | None, form: str) -> str:
    return "" if value is None else form.format(value)


def _simulators(replica: ReplicaStatus) -> str:
    ready = sum(simulator.state == "ready" and not simulator.given_up for simulator in replica.simulators)
    return f"{ready}/{len(replica.simulators)}, {replica.restarts.simulator} restarts"


def _color(phase: Phase | None) -> str:
    return COLOURS[phase] if phase else "dim"
