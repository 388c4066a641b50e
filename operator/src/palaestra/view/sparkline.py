"""A bar chart in one line of text, with one character for each value."""

from collections.abc import Sequence

BARS = "▁▂▃▄▅▆▇█"
UNKNOWN = " "


def sparkline(
    values: Sequence[float | None], *, lowest: float | None = None, highest: float | None = None
) -> str:
    """Return one bar character for each value, higher for larger values, or a space for an unknown value.

    Args:
        values: numbers to draw, oldest first; None: unknown.
        lowest: the value of the lowest bar; None: the smallest value in `values`.
        highest: the value of the highest bar; None: the largest value in `values`.
    """
    known = [value for value in values if value is not None]
    if not known:
        return UNKNOWN * len(values)
    floor = min(known) if lowest is None else lowest
    ceiling = max(known) if highest is None else highest
    return "".join(_bar(value, floor, ceiling) for value in values)


def _bar(value: float | None, floor: float, ceiling: float) -> str:
    if value is None:
        return UNKNOWN
    if ceiling <= floor:  # all values are equal, so the bar has half the height
        return BARS[len(BARS) // 2]
    share = (value - floor) / (ceiling - floor)
    return BARS[min(max(round(share * (len(BARS) - 1)), 0), len(BARS) - 1)]
