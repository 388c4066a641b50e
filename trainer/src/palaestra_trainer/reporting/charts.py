"""Draw curves as SVG in the colors of the page's style; a browser shows them without a script."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from palaestra_trainer.reporting.elements import Markup, element, joined
from palaestra_trainer.reporting.run_data import Points

WIDTH, HEIGHT = 360.0, 210.0
LEFT, RIGHT, TOP, BOTTOM = 46.0, 8.0, 10.0, 26.0
SIZES = ((1e6, 1e6, "M"), (1e4, 1e3, "k"))  # smallest number for a unit, the unit, and its letter
COLORS = 8  # number of colors that the style sheet has for series
MOST_POINTS = 240  # most points of one curve; a screen cannot show more


@dataclass(frozen=True, slots=True, kw_only=True)
class Series:
    """One curve.

    Attributes:
        label: name of the curve.
        points: step and value of each point.
        band: intervals around the curve, each as step, lower bound and upper bound.
        dots: whether each point is drawn as a dot with its value.
        color: number of the color in the style.
    """

    label: str
    points: Points
    band: tuple[tuple[float, float, float], ...] = ()
    dots: bool = False
    color: int = 0


@dataclass(frozen=True, slots=True)
class _Scale:
    low: float
    high: float
    start: float
    end: float

    def __call__(self, value: float) -> float:
        return self.start + (value - self.low) / (self.high - self.low) * (self.end - self.start)


def thinned(points: Points, most: int = MOST_POINTS) -> Points:
    """Return at most `most` points, each the mean of a group of neighboring points."""
    if len(points) <= most:
        return points
    size = math.ceil(len(points) / most)
    groups = [points[start : start + size] for start in range(0, len(points), size)]
    return tuple((group[-1][0], sum(value for _, value in group) / len(group)) for group in groups)


def shown(value: float) -> str:
    """Return a number as text for an axis or a tooltip."""
    for size, unit, letter in SIZES:
        if abs(value) >= size:
            return f"{value / unit:.4g}{letter}"
    return f"{value:.4g}"


def as_share(value: float) -> str:
    """Return a share from 0 to 1 as text in percent."""
    return f"{100 * value:.0f} %"


def chart(
    title: str,
    series: Sequence[Series],
    *,
    share: bool = False,
    marks: Sequence[tuple[float, str]] = (),
) -> Markup:
    """Return a figure with curves over the steps of a run.

    Args:
        title: caption of the figure.
        series: the curves; curves without points are omitted.
        share: whether the values are shares from 0 to 1; the axis then ranges from 0 to 100 %.
        marks: steps to mark on the axis, with a text for each.
    """
    drawn = [one for one in series if one.points]
    if not drawn:
        return joined()
    x, y = _scales(drawn, share=share)
    word = as_share if share else shown
    parts = [_grid(x, y, word)]
    parts += [_band(one, x, y) for one in drawn if one.band]
    parts += [_line(one, x, y) for one in drawn]
    parts += [_dots(one, x, y, word) for one in drawn if one.dots]
    parts += [
        element(
            "path",
            element("title", text),
            d=f"M{x(step):.1f} {HEIGHT - BOTTOM:.1f}l-4 7h8z",
            class_="mark",
        )
        for step, text in marks
        if x.low <= step <= x.high
    ]
    picture = element(
        "svg",
        *parts,
        viewBox=f"0 0 {WIDTH:g} {HEIGHT:g}",
        role="img",
        aria_label=title,
    )
    return element("figure", element("figcaption", title, _legend(drawn)), picture, class_="chart")


def _scales(series: Sequence[Series], *, share: bool) -> tuple[_Scale, _Scale]:
    steps = [step for one in series for step, _ in one.points]
    values = [value for one in series for _, value in one.points]
    values += [bound for one in series for _, *bounds in one.band for bound in bounds]
    low, high = (0.0, 1.0) if share else _padded(min(values), max(values))
    first, last = min(0.0, *steps), max(steps)
    if last <= first:
        last = first + 1.0
    return _Scale(first, last, LEFT, WIDTH - RIGHT), _Scale(low, high, HEIGHT - BOTTOM, TOP)


def _padded(low: float, high: float) -> tuple[float, float]:
    """Return bounds around values; the bounds differ by enough for distinct ticks."""
    least = max(abs(low), abs(high), 1e-9) * (0.1 if low == high else 1e-3)  # ticks show only four digits
    pad = max(0.06 * (high - low), least)
    return low - pad, high + pad


def ticks(low: float, high: float, most: int = 5) -> list[float]:
    """Return at most `most` + 1 round numbers from `low` to `high`."""
    raw = (high - low) / most
    if not (raw > 0 and math.isfinite(raw)):
        return [low]
    power = 10.0 ** math.floor(math.log10(raw))
    step = next((times * power for times in (1, 2, 5) if times * power >= raw), 10 * power)
    if not (step > 0 and math.isfinite(step)):
        return [low]
    first = math.ceil(low / step)
    return [value for index in range(most + 2) if low <= (value := (first + index) * step) <= high]


def _grid(x: _Scale, y: _Scale, word: Callable[[float], str]) -> Markup:
    parts = []
    for value in ticks(y.low, y.high):
        at = y(value)
        parts.append(element("line", x1=LEFT, x2=WIDTH - RIGHT, y1=at, y2=at, class_="grid"))
        label = word(value)
        parts.append(element("text", label, x=LEFT - 6, y=at + 4, class_="tick end"))
    for value in ticks(x.low, x.high):
        anchor = "tick end" if x(value) > WIDTH - 30 else "tick middle"
        where = min(x(value), WIDTH - 2)
        parts.append(element("text", shown(value), x=where, y=HEIGHT - 8, class_=anchor))
    return joined(*parts)


def _line(one: Series, x: _Scale, y: _Scale) -> Markup:
    places = " ".join(f"{x(step):.1f},{_within(y, value):.1f}" for step, value in one.points)
    return element("polyline", points=places, class_=f"line c{one.color % COLORS}")


def _band(one: Series, x: _Scale, y: _Scale) -> Markup:
    upper = [f"{x(step):.1f},{_within(y, high):.1f}" for step, _, high in one.band]
    lower = [f"{x(step):.1f},{_within(y, low):.1f}" for step, low, _ in reversed(one.band)]
    return element("polygon", points=" ".join(upper + lower), class_=f"band c{one.color % COLORS}")


def _dots(one: Series, x: _Scale, y: _Scale, word: Callable[[float], str]) -> Markup:
    bounds = {step: (low, high) for step, low, high in one.band}
    dots = []
    for step, value in one.points:
        text = f"{one.label}: {word(value)} at step {step:,.0f}"
        if step in bounds:
            low, high = bounds[step]
            text += f" ({word(low)} to {word(high)})"
        dots.append(
            element(
                "circle",
                element("title", text),
                cx=x(step),
                cy=_within(y, value),
                r=2.5,
                class_=f"dot c{one.color % COLORS}",
            )
        )
    return joined(*dots)


def _within(y: _Scale, value: float) -> float:
    return y(min(max(value, y.low), y.high))


def _legend(series: Sequence[Series]) -> Markup:
    if not series[1:]:  # the title is enough for a single curve
        return joined()
    names = [
        element("span", element("i", class_=f"key c{one.color % COLORS}"), one.label, class_="series")
        for one in series
    ]
    return element("span", *names, class_="legend")
