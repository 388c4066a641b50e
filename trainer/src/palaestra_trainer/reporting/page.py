"""Build a report as one HTML page of a bounded size, for one run or for several runs side by side.

The functions are pure: the same data give the same page. The page has no links: it contains its style, script
and pictures. Its Content-Security-Policy makes a browser refuse every request.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from importlib.resources import files

from palaestra_trainer.reporting.charts import COLORS, Series, chart, thinned
from palaestra_trainer.reporting.elements import Markup, element, joined, own_code
from palaestra_trainer.reporting.run_data import RunData
from palaestra_trainer.reporting.sections import (
    Detail,
    chip,
    cut,
    return_series,
    run_sections,
    success_series,
    table,
)

MOST_BYTES = 2_500_000
MOST_RUNS = 200
POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'"
NAME = 120  # most characters of a run's name
# Each pair limits the comparison of runs: points of a curve, and characters of a cell.
COMPARISONS = ((120, 120), (20, 40), (4, 12))
# A page uses the first of these entries that keeps the page within its size limit.
DETAILS: tuple[Detail | None, ...] = (
    Detail(curves=24, points=240, replays=3, space=True, faults=300, rows=100, text=60_000),
    Detail(curves=24, points=120, replays=3, space=True, faults=60, rows=40, text=8_000),
    Detail(curves=8, points=60, replays=1, space=False, faults=20, rows=30, text=0),
    Detail(curves=0, points=30, replays=0, space=False, faults=5, rows=15, text=0),
    None,  # only the comparison of runs
)


def page(runs: Sequence[RunData], most_bytes: int = MOST_BYTES) -> str:
    """Return the report of runs, with the most details for which the page has at most `most_bytes`.

    Only the first `MOST_RUNS` runs are shown.

    Raises:
        ValueError: even the page without details is larger than `most_bytes`; this cannot happen with the
            default.
    """
    shown = runs[:MOST_RUNS]
    for detail in DETAILS:
        sections = _sections(shown, detail, most_bytes)
        for size in COMPARISONS if sections is not None else ():
            text = "<!doctype html>\n" + _document(shown, len(runs), sections or (), size)
            if len(text.encode()) <= most_bytes:
                return text
    raise ValueError(f"a report of {len(runs)} runs needs more than {most_bytes:,} bytes; give fewer runs")


def _sections(runs: Sequence[RunData], detail: Detail | None, most_bytes: int) -> list[Markup] | None:
    """Return the sections of each run; None if their total size exceeds `most_bytes`."""
    sections: list[Markup] = []
    if detail is None:
        return sections
    for run in runs:
        sections.append(run_sections(run, detail))
        most_bytes -= len(sections[-1])
        if most_bytes < 0:
            return None
    return sections


def _document(
    runs: Sequence[RunData], number: int, sections: Sequence[Markup], size: tuple[int, int]
) -> Markup:
    title = cut(runs[0].name, NAME) if number == 1 else f"{number:,} runs"
    head = element(
        "head",
        element("meta", charset="utf-8"),
        element("meta", name="viewport", content="width=device-width, initial-scale=1"),
        element("meta", http_equiv="Content-Security-Policy", content=POLICY),
        element("title", f"{title} \u00b7 Palaestra"),
        own_code("style", _part("page.css")),
    )
    if number == 1:
        content = joined(element("h1", cut(runs[0].name, NAME)), *sections)
    else:
        content = _several(runs, number, sections, size)
    scripts = [own_code("script", _part(name)) for name in ("space.js", "page.js")]
    body = element("body", element("main", content), *scripts)
    return element("html", head, body, lang="en")


def _part(name: str) -> str:
    return files("palaestra_trainer.reporting").joinpath(name).read_text(encoding="utf-8")


def _several(
    runs: Sequence[RunData], number: int, sections: Sequence[Markup], size: tuple[int, int]
) -> Markup:
    more = element("p", f"The first {len(runs)} are shown.") if number > len(runs) else joined()
    each = [
        element(
            "details",
            element("summary", cut(run.name, NAME), " ", chip(run)),
            content,
            class_="run",
        )
        for run, content in zip(runs, sections, strict=False)
    ]
    return joined(
        element("h1", f"{number:,} runs side by side"),
        more,
        element("h2", "Results"),
        _results(runs, size[1]),
        _comparison(runs, size[0]),
        _differences(runs, size[1]),
        *each,
    )


def _results(runs: Sequence[RunData], width: int) -> Markup:
    names = list(dict.fromkeys(name for run in runs for name in run.figures))[:12]
    rows = [
        (cut(run.name, width), chip(run), *(cut(run.figures.get(name, ""), width) for name in names))
        for run in runs
    ]
    return table(("run", "end", *(cut(name, width) for name in names)), rows)


def _comparison(runs: Sequence[RunData], points: int) -> Markup:
    """Return charts with the curves of all runs; if there are more runs than colors, runs share colors."""

    def drawn(of: Callable[[RunData, int], Series]) -> list[Series]:
        return [of(run, index) for index, run in enumerate(runs)]

    def label(run: RunData) -> str:
        return cut(run.name, 40)

    banded = len(runs) <= COLORS  # the bands of more runs would hide each other
    rates = drawn(lambda run, index: success_series(run.evaluations, label(run), index, points, line=banded))
    returns = drawn(lambda run, index: return_series(run.evaluations, label(run), index, points))
    charts = [
        chart("success rate", _bare(rates, points, banded=banded), share=True),
        chart("mean return of evaluations", _bare(returns, points, banded=banded)),
    ]
    common = [name for name in runs[0].curves if sum(name in run.curves for run in runs) > 1]
    charts += [
        chart(
            cut(name, NAME),
            [
                Series(label=label(run), points=thinned(run.curves.get(name, ()), points), color=index)
                for index, run in enumerate(runs)
            ],
        )
        for name in common[:4]
    ]
    return element("div", *charts, class_="grid") if any(charts) else joined()


def _bare(series: Sequence[Series], points: int, *, banded: bool) -> list[Series]:
    return [
        one
        if banded
        else Series(label=one.label, points=thinned(one.points, points), dots=False, color=one.color)
        for one in series
    ]


def _differences(runs: Sequence[RunData], width: int) -> Markup:
    """Return a table of the settings and versions in which the runs differ."""
    names = dict.fromkeys(name for run in runs for name in (*run.asked, *run.versions))
    rows = []
    for name in names:
        values = [_value(run.asked, run.versions, name) for run in runs]
        if len(set(values)) > 1:
            rows.append((cut(name, NAME), *(cut(value, width) for value in values)))
    if not rows:
        return joined()
    heads = ("", *(cut(run.name, min(width, 40)) for run in runs))
    return joined(element("h2", "Differences"), table(heads, rows[:40]))


def _value(asked: Mapping[str, str], versions: Mapping[str, str], name: str) -> str:
    return asked.get(name, versions.get(name, ""))
