"""The result of a sweep as text: a line for each trial, and a line about the best trial."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from statistics import quantiles
from typing import Any

from palaestra.sweeps.grid import short
from palaestra.sweeps.model import Objective
from palaestra.sweeps.trial import TrialFigures, TrialProgress

WORDS = {Objective.SUCCESS_RATE: "success rate", Objective.MEAN_RETURN: "mean return"}


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialRow:
    """One trial of the result."""

    name: str
    changes: Mapping[str, Any]
    figures: TrialFigures


def lines(rows: Sequence[TrialRow], objective: Objective) -> Iterator[str]:
    """Yield the table, and a line about the best complete trial."""
    fields = short(dict.fromkeys(field for row in rows for field in row.changes))
    heading = ("trial", *fields.values(), "state", "seeds", WORDS[objective], "quartiles")
    cells = [
        (row.name, *(_text(row.changes.get(field)) for field in fields), *_result(row, objective))
        for row in rows
    ]
    yield from _aligned([heading, *cells])
    if (top := best(rows, objective)) is not None:
        yield ""
        yield ", ".join((f"best: {top.name}", *(f"{key} = {_text(top.changes[key])}" for key in top.changes)))


def best(rows: Iterable[TrialRow], objective: Objective) -> TrialRow | None:
    """Return the complete trial with the highest median (of equal trials, the first), or None."""
    complete = [
        row for row in rows if row.figures.state is TrialProgress.COMPLETE and row.figures.values(objective)
    ]
    return max(complete, key=lambda row: row.figures.median(objective) or 0.0, default=None)


def quartiles(values: Sequence[float]) -> tuple[float, float]:
    """Return the first and the third quartile of `values`, which has at least one value."""
    if len(values) == 1:
        return values[0], values[0]
    low, _, high = quantiles(values, n=4, method="inclusive")
    return low, high


def _result(row: TrialRow, objective: Objective) -> Iterator[str]:
    values = row.figures.values(objective)
    yield row.figures.state.value
    yield (
        f"{sum(run.succeeded for run in row.figures.runs)}/{len(row.figures.runs)}"
        if row.figures.runs
        else "-"
    )
    yield f"{row.figures.median(objective):.3g}" if values else "-"
    yield "{:.3g} to {:.3g}".format(*quartiles(values)) if values else "-"


def _text(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _aligned(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        yield "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
