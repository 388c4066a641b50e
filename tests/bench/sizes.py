"""The size of a measurement at a scale: the full size at 1, and the smallest useful size at 0."""


def scaled(whole: int, scale: float, least: int = 1) -> int:
    """Return a share of a count, but at least `least`."""
    return max(round(whole * scale), least)
