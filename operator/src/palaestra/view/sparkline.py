"""A line of figures in as many characters."""

from collections.abc import Sequence

BARS = "▁▂▃▄▅▆▇█"
UNKNOWN = " "


def sparkline(
    values: Sequence[float | None], *, lowest: float | None = None, highest: float | None = None
) -> str:
    """Return one character a value, the higher the larger; a space for what is not known.

    Args:
        values: oldest first.
        lowest: what the lowest bar stands for; None: the least of the values.
        highest: what the highest bar stands for; None: the greatest of them.
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
    if ceiling <= floor:  # all are equal: neither low nor high
        return BARS[len(BARS) // 2]
    share = (value - floor) / (ceiling - floor)
    return BARS[min(max(round(share * (len(BARS) - 1)), 0), len(BARS) - 1)]
