"""Durations in their two largest units: `45s`, `3m12s`, `2h5m`, `3d4h`."""

from datetime import datetime

MINUTE, HOUR, DAY = 60, 3600, 86_400
UNITS = (("d", DAY), ("h", HOUR), ("m", MINUTE), ("s", 1))


def short(seconds: float) -> str:
    """Return a duration as text for people; `0s` for less than a second and for a negative duration."""
    left = max(int(seconds), 0)
    parts: list[tuple[int, str]] = []
    for unit, size in UNITS:
        if left >= size or parts:
            parts.append((left // size, unit))
            left %= size
    named = [f"{count}{unit}" for count, unit in parts[:2] if count]
    return "".join(named) or "0s"


def ago(moment: datetime | None, now: datetime) -> str:
    """Return the time since a moment, such as `3m12s ago`; empty without a moment."""
    return "" if moment is None else f"{short((now - moment).total_seconds())} ago"
