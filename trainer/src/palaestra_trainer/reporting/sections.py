"""Build the sections of a report about one run, from its results and curves to the job."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import fmean, stdev

from palaestra_protocol.scene import VisibleScene
from palaestra_trainer.reporting.charts import Series, chart, thinned
from palaestra_trainer.reporting.elements import Markup, element, joined
from palaestra_trainer.reporting.replay import replay_figure
from palaestra_trainer.reporting.run_data import Evaluated, ReportedFault, RunData
from palaestra_trainer.reporting.space import scenes_script

NUMBER = re.compile(r"-?[0-9][0-9,]*(\.[0-9]+)?%?")
DEVIATIONS = 1.96  # half width of a 95 % interval, in standard deviations of a mean
MOST_TEXT = 400  # most characters of one message
NEVER = "\u2013"  # shown if the simulator did not come up again in the attempt of the fault
ENDED = {"good": "complete", "interrupted": "interrupted", "failed": "failed", "open": "not ended"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Detail:
    """Limits for the details of a run on a page.

    Attributes:
        curves: number of training curves.
        points: number of points of one curve.
        replays: number of recorded episodes.
        space: whether the recorded episodes are shown in three dimensions.
        faults: number of rows in the table of faults.
        rows: number of rows in other tables, and of names in lists.
        text: number of characters of each file.
    """

    curves: int
    points: int
    replays: int
    space: bool
    faults: int
    rows: int
    text: int


def run_sections(run: RunData, detail: Detail) -> Markup:
    """Return all sections about one run, which the page shows below the name of the run."""
    return joined(
        figures(run),
        *_section(f"Episodes of {run.replayed}", _replays(run, detail)),
        *_section("Curves", _curves(run, detail)),
        *_section("Decisions", table(("time", "decision"), run.decisions[-detail.rows :])),
        *(() if run.decisions else _section(f"Faults: {run.fault_count:,}", _faults(run, detail))),
        *_section("Where the time went", _goodput(run.goodput)),
        *_section("Checkpoints", table(("step", "size", "written"), run.checkpoints[-detail.rows :])),
        *_section("Settings", _names(run.asked, detail.rows)),
        *_section("Versions", _names(run.versions, detail.rows)),
        *_section("Attempts", table(("started", "reason"), run.attempts[-detail.rows :])),
        *_section("How to repeat it", _repeat(run, detail)),
    )


def chip(run: RunData) -> Markup:
    """Return the end of a run in one word."""
    ended = run.ended if run.ended in ENDED else "open"
    return element("span", ENDED[ended], class_=f"chip {ended}")


def figures(run: RunData) -> Markup:
    """Return the end of a run and its main results."""
    cards = [element("div", element("dt", name), element("dd", text)) for name, text in run.figures.items()]
    return joined(
        element("p", chip(run), f" {cut(run.end, MOST_TEXT)}"), element("dl", *cards, class_="figures")
    )


def cut(text: str, most: int) -> str:
    """Return a text, cut after `most` characters."""
    return text if len(text) <= most else text[:most] + " \u2026"


def success_series(
    evaluated: Sequence[Evaluated], label: str, color: int, points: int, *, line: bool = True
) -> Series:
    """Return a curve of the success rates, with their intervals as a band."""
    known = [one for one in evaluated if one.success_rate is not None][-points:]
    rates = tuple((one.step, one.success_rate or 0.0) for one in known)
    band = tuple(
        (one.step, one.low, one.high) for one in known if one.low is not None and one.high is not None
    )
    return Series(label=label, points=rates, band=band if line else (), dots=True, color=color)


def return_series(evaluated: Sequence[Evaluated], label: str, color: int, points: int) -> Series:
    """Return a curve of the mean returns; the band is the 95 % interval of each mean."""
    known = [one for one in evaluated if one.returns][-points:]
    return Series(
        label=label,
        points=tuple((one.step, fmean(one.returns)) for one in known),
        band=tuple(_interval(one) for one in known),
        dots=True,
        color=color,
    )


def _interval(one: Evaluated) -> tuple[float, float, float]:
    mean, number = fmean(one.returns), len(one.returns)
    half = DEVIATIONS * stdev(one.returns) / math.sqrt(number) if number > 1 else 0.0
    return one.step, mean - half, mean + half


def _section(title: str, *content: Markup) -> Iterator[Markup]:
    if any(content):
        yield element("section", element("h2", title), *content)


def _replays(run: RunData, detail: Detail) -> Markup:
    replays = run.replays[: detail.replays]
    if not detail.space:
        replays = tuple(replace(replay, space=None) for replay in replays)
    scenes: list[VisibleScene] = []
    for replay in replays:
        if replay.space is not None and replay.space.scene not in scenes:
            scenes.append(replay.space.scene)
    shown = [replay_figure(replay, scenes) for replay in replays]
    if not shown:
        return joined()
    return joined(scenes_script(scenes) if scenes else joined(), element("div", *shown, class_="grid"))


def _curves(run: RunData, detail: Detail) -> Markup:
    marks = [(fault.step, f"{fault.simulator}: {fault.kind}") for fault in run.faults[: detail.points]]
    rates = success_series(run.evaluations, "evaluations", 0, detail.points)
    confirmed = success_series(run.confirmations, "confirmations", 1, detail.points, line=False)
    lengths = tuple((one.step, one.mean_length) for one in run.evaluations if one.mean_length is not None)
    charts = [
        chart("success rate, with 95 % intervals", [rates, confirmed], share=True, marks=marks),
        chart(
            "mean return of evaluations, with 95 % intervals",
            [return_series(run.evaluations, "evaluations", 0, detail.points)],
            marks=marks,
        ),
        chart(
            "mean length of an evaluation's episodes, steps",
            [Series(label="evaluations", points=thinned(lengths, detail.points), dots=True)],
        ),
    ]
    charts += [
        chart(cut(name, MOST_TEXT), [Series(label=name, points=thinned(points, detail.points), color=7)])
        for name, points in list(run.curves.items())[: detail.curves]
    ]
    drawn = [one for one in charts if one]
    return element("div", *drawn, class_="grid") if drawn else joined()


def _faults(run: RunData, detail: Detail) -> Markup:
    if not run.fault_count and not run.faults:
        return element("p", "No simulator failed.", class_="soft")
    listed = run.faults[-detail.faults :] if detail.faults else ()
    rows = [_fault_row(fault) for fault in listed]
    note = f"The last {len(rows):,} are listed." if run.fault_count > len(rows) else ""
    names = ("time", "step", "simulator", "kind", "seconds until it was up", "steps lost", "message")
    return joined(element("p", note, class_="soft") if note else joined(), table(names, rows))


def _fault_row(fault: ReportedFault) -> tuple[str, ...]:
    seconds = NEVER if fault.seconds is None else f"{fault.seconds:.1f}"
    return (
        cut(fault.time, 40),
        f"{fault.step:,.0f}",
        cut(fault.simulator, 80),
        cut(fault.kind, 40),
        seconds,
        f"{fault.steps_lost:,.0f}",
        cut(fault.fact, MOST_TEXT),
    )


def _goodput(goodput: Mapping[str, float]) -> Markup:
    spent = {cause: seconds for cause, seconds in goodput.items() if seconds > 0}
    total = sum(spent.values())
    if not total:
        return joined()
    shares = {cause: seconds / total for cause, seconds in spent.items()}
    bar = [
        element("i", class_=f"c{index % 8}", style=f"flex:{1000 * share:.1f}", title=f"{cause} {share:.1%}")
        for index, (cause, share) in enumerate(shares.items())
    ]
    rows = [
        (joined(element("i", class_=f"key c{index % 8}"), cause), f"{spent[cause]:,.1f}", f"{share:.1%}")
        for index, (cause, share) in enumerate(shares.items())
    ]
    return joined(element("div", *bar, class_="bar"), table(("cause", "seconds", "share"), rows))


def _repeat(run: RunData, detail: Detail) -> Markup:
    ways = [
        joined(element("p", cut(text, MOST_TEXT)), element("pre", command)) for text, command in run.repeat
    ]
    files = [
        element("details", element("summary", name), element("pre", cut(text, detail.text)))
        for name, text in run.files.items()
    ]
    return joined(*ways, *(files if detail.text else ()))


def _names(values: Mapping[str, str], most: int) -> Markup:
    rows = list(values.items())[:most]
    if not rows:
        return joined()
    words = (
        element(tag, cut(text, MOST_TEXT))
        for row in rows
        for tag, text in zip(("dt", "dd"), row, strict=True)
    )
    return element("dl", *words, class_="names card")


def table(names: Sequence[str], rows: Iterable[Sequence[str]]) -> Markup:
    """Return a table in a frame that scrolls separately; columns of numbers are aligned right."""
    body = list(rows)
    if not body:
        return joined()
    kinds = [_kind(name, [row[index] for row in body]) for index, name in enumerate(names)]
    head = element("tr", *[element("th", name, class_=kind) for name, kind in zip(names, kinds, strict=True)])
    lines = [
        element("tr", *[element("td", text, class_=kind) for text, kind in zip(row, kinds, strict=True)])
        for row in body
    ]
    return element("div", element("table", head, *lines), class_="scroll card")


def _kind(name: str, cells: Sequence[str]) -> str | None:
    if name == "message":
        return "fact"
    return "number" if all(cell == NEVER or NUMBER.fullmatch(cell) for cell in cells) else None
