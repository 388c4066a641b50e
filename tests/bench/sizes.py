"""The size of a measurement at a scale: all of it at 1, and the least that runs its code at 0."""


def scaled(whole: int, scale: float, least: int = 1) -> int:
    """Return a share of a count, but at least `least`."""
    return max(round(whole * scale), least)
