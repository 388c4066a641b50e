"""Draw a dashboard as a picture, with its panels in their Grafana positions and data from Prometheus.

The pictures are for the documentation. Their content comes from the dashboard's JSON, but their style differs
from Grafana's.
"""

import itertools
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter, Formatter, FuncFormatter, PercentFormatter

from tests.monitoring.questions import panels

COLUMNS = 24
COLUMN_IN, UNIT_IN = 0.62, 0.34  # the width of a grid column and the height of a grid row, in inches
MARGINS_IN = {"left": 0.62, "right": 0.15, "top": 0.42, "bottom": 0.62}
MOST_NAMES = 8  # more names in a legend would cover the curves
LETTER_IN, MARK_IN = 0.05, 0.35  # the width of a letter in a legend, and of the rest of an entry
DPI = 90
STYLE: dict[Any, Any] = {
    "font.size": 8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
}
BIG = EngFormatter(sep="")
UNITS: Mapping[str, Formatter] = {
    "percentunit": PercentFormatter(1.0, decimals=0),
    "bytes": EngFormatter("B", places=0),
    "s": EngFormatter("s"),
    "ops": FuncFormatter(lambda value, _: f"{value:g}/s"),
}
PLAIN = FuncFormatter(lambda value, _: f"{value:g}" if abs(value) < 1000 else BIG(value))


@dataclass(frozen=True, slots=True)
class Line:
    """A series: its name, the minutes since the start of the run, and the values."""

    name: str
    minutes: Any
    values: Any
    labels: Mapping[str, str]


Answers = Mapping[int, Sequence[Line]]  # keys: the numbers of panels


def line(series: Mapping[str, Any], legend: str, began: float) -> Line:
    """Return a series of a range query, named by the legend; `began` is Unix time.

    A name leaves out the job and the replica, because a picture shows only one run.
    """
    brief = legend.removeprefix("{{training_job}}/{{replica}} ")
    name = re.sub(r"{{\s*(\w+)\s*}}", lambda label: series["metric"].get(label[1], ""), brief)
    times, values = zip(*series["values"], strict=True)
    minutes = (np.array(times, dtype=float) - began) / 60
    numbers = np.array(values, dtype=float)
    return Line(name.strip(), minutes, np.where(np.isfinite(numbers), numbers, np.nan), series["metric"])


def draw(dashboard: Mapping[str, Any], answers: Answers, title: str, file: Path) -> None:
    """Draw a dashboard and write the picture to a file."""
    with mpl.rc_context(STYLE):
        height = max(place["y"] + place["h"] for place in (it["gridPos"] for it in dashboard["panels"])) + 2
        figure = Figure(figsize=(COLUMNS * COLUMN_IN, height * UNIT_IN), layout=None)
        figure.text(0.01, 1 - 0.7 / height, title, fontsize=13, weight="bold", va="center")
        for heading in (it for it in dashboard["panels"] if it["type"] == "row"):
            below = 1 - (heading["gridPos"]["y"] + 2.6) / height
            figure.text(0.01, below, heading["title"], fontsize=11, color="#666666", va="center")
        for panel in panels(dashboard):
            axes = _axes(figure, panel["gridPos"], height)
            axes.set_title(panel["title"])
            DRAWN[panel["type"]](axes, panel, answers.get(panel["id"], ()))
        file.parent.mkdir(exist_ok=True)
        figure.savefig(file, dpi=DPI, facecolor="white")


def _axes(figure: Figure, place: Mapping[str, int], height: int) -> Axes:
    width_in, height_in = COLUMNS * COLUMN_IN, height * UNIT_IN
    left = place["x"] * COLUMN_IN + MARGINS_IN["left"]
    top = height_in - (place["y"] + 2) * UNIT_IN - MARGINS_IN["top"]
    wide = place["w"] * COLUMN_IN - MARGINS_IN["left"] - MARGINS_IN["right"]
    high = place["h"] * UNIT_IN - MARGINS_IN["top"] - MARGINS_IN["bottom"]
    box = (left / width_in, (top - high) / height_in, wide / width_in, high / height_in)
    return figure.add_axes(box)


def _timeseries(axes: Axes, panel: Mapping[str, Any], lines: Sequence[Line]) -> None:
    defaults = panel["fieldConfig"]["defaults"]
    if "stacking" in defaults["custom"]:
        _stack(axes, lines)
    else:
        for each in lines:
            axes.plot(*_with_gaps(each), label=each.name, linewidth=1.4)
    axes.margins(x=0.01)
    axes.set_ylim(defaults.get("min"), defaults["max"] * 1.03 if "max" in defaults else _top(lines, defaults))
    axes.yaxis.set_major_formatter(_unit(defaults["unit"]))
    if "thresholdsStyle" in defaults["custom"]:
        axes.axhline(
            defaults["thresholds"]["steps"][-1]["value"], color="#cc3333", linewidth=1, linestyle="--"
        )
    _name(axes)


def _with_gaps(series: Line) -> tuple[Any, Any]:
    """Return minutes and values, with a gap where two points are far apart, as in Grafana."""
    apart = np.diff(series.minutes)
    gaps = np.flatnonzero(apart > 1.5 * apart.min(initial=np.inf)) + 1
    return np.insert(series.minutes, gaps, np.nan), np.insert(series.values, gaps, np.nan)


def _top(lines: Sequence[Line], defaults: Mapping[str, Any]) -> float | None:
    """Return the upper end of the axis, a little above the values, or None for matplotlib's choice."""
    if "min" not in defaults or not lines or "stacking" in defaults["custom"]:
        return None
    most = np.nanmax([0.0, *(np.nanmax(each.values, initial=0.0) for each in lines)])
    return float(most) * 1.1 or 1.0


def _stack(axes: Axes, series: Sequence[Line]) -> None:
    lines = [each for each in series if each.values.any()]  # a line of zeros needs no entry in the legend
    minutes = np.unique(np.concatenate([each.minutes for each in lines] or [np.array([])]))
    values = [np.interp(minutes, each.minutes, each.values) for each in lines]
    axes.stackplot(minutes, *values, labels=[each.name for each in lines], alpha=0.75)


def _stat(axes: Axes, panel: Mapping[str, Any], lines: Sequence[Line]) -> None:
    axes.axis("off")
    unit = _unit(panel["fieldConfig"]["defaults"]["unit"])
    for each, at in zip(lines, np.linspace(0, 1, len(lines) * 2 + 1)[1::2], strict=False):
        axes.text(at, 0.6, unit(each.values[-1]), fontsize=26, color="#2a7d2a", ha="center", va="center")
        axes.text(at, 0.15, each.name, ha="center", va="center", color="#666666")


def _heatmap(axes: Axes, panel: Mapping[str, Any], lines: Sequence[Line]) -> None:
    """Draw the number of values in each bucket.

    A bucket of Prometheus also counts all smaller values, so this number is the difference of two buckets.
    """
    buckets = sorted(lines, key=lambda each: float(each.labels["le"]))
    if not buckets:
        return
    minutes = np.unique(np.concatenate([each.minutes for each in buckets]))
    counted = np.array([np.interp(minutes, each.minutes, each.values) for each in buckets])
    inside = np.diff(counted, axis=0, prepend=0).clip(min=0)
    seen = np.flatnonzero(inside.sum(axis=1))
    shown = slice(max(int(seen.min()) - 1, 0), int(seen.max()) + 2) if len(seen) else slice(None)
    axes.pcolormesh(minutes, np.arange(len(inside[shown])), inside[shown], cmap="magma_r", shading="nearest")
    unit = _unit(panel["fieldConfig"]["defaults"]["unit"])
    bounds = [float(each.labels["le"]) for each in buckets[shown]]
    names = ["more" if np.isinf(bound) else f"≤ {unit(bound)}" for bound in bounds]
    every = max(1, len(names) // 8)
    axes.set_yticks(range(0, len(names), every), names[::every])
    axes.grid(visible=False)
    axes.set_xlabel("minutes")


def _unit(name: str) -> Formatter:
    return UNITS.get(name, PLAIN)


def _name(axes: Axes) -> None:
    axes.set_xlabel("minutes", labelpad=1)
    handles, names = axes.get_legend_handles_labels()
    if not names:
        axes.text(0.5, 0.5, "no data", transform=axes.transAxes, ha="center", color="#999999")
        return
    shown = list(itertools.islice(zip(handles, names, strict=True), MOST_NAMES))
    axes.legend(
        [handle for handle, _ in shown],
        [name for _, name in shown],
        loc="upper left",
        bbox_to_anchor=(0, -0.2),
        ncols=_fitting(axes, max(len(name) for _, name in shown)),
        fontsize=6.5,
        frameon=False,
        handlelength=1.2,
        columnspacing=1.0,
        borderpad=0,
    )


def _fitting(axes: Axes, letters: int) -> int:
    """Return how many entries with this many letters fit next to each other below the axes."""
    width_in = axes.get_position().width * COLUMNS * COLUMN_IN
    return max(1, int(width_in / (LETTER_IN * letters + MARK_IN)))


DRAWN: Mapping[str, Callable[[Axes, Mapping[str, Any], Sequence[Line]], None]] = {
    "timeseries": _timeseries,
    "stat": _stat,
    "heatmap": _heatmap,
}
