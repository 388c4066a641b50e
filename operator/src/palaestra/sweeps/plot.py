"""The result of a sweep as a figure: learning curves, with median and quartiles over the seeds."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from palaestra.sweeps.model import Objective
from palaestra.sweeps.table import WORDS, TrialRow, quartiles

MOST_CURVES = 10  # the number of different colors of the curves


def draw(rows: Sequence[TrialRow], objective: Objective, file: Path) -> bool:
    """Write the curves of the best trials into `file`; return False if no trial has a curve."""
    drawn = sorted(
        (row for row in rows if row.figures.common(objective)),
        key=lambda row: -max(row.figures.common(objective).values()),
    )[:MOST_CURVES]
    if not drawn:
        return False
    figure = Figure(figsize=(8, 5), layout="constrained")
    axes = figure.subplots()
    for row in drawn:
        curve = row.figures.common(objective)
        [line] = axes.plot(*zip(*curve.items(), strict=True), label=_label(row))
        lows, highs = zip(*(quartiles(row.figures.at(step, objective)) for step in curve), strict=True)
        axes.fill_between(list(curve), lows, highs, color=line.get_color(), alpha=0.2, linewidth=0)
    axes.set(xlabel="environment steps", ylabel=f"{WORDS[objective]} (median, quartiles)")
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small")
    figure.savefig(file, dpi=120)
    return True


def _label(row: TrialRow) -> str:
    values = (f"{value:.4g}" if isinstance(value, float) else str(value) for value in row.changes.values())
    return f"{row.name}: {', '.join(values)}"
