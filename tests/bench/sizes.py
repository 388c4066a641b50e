"""How much a measurement does at a scale: all of it at 1, the least that runs its code at 0."""


def scaled(whole: int, scale: float, least: int = 1) -> int:
    """Return a share of a count, and `least` where that is less."""
    return max(round(whole * scale), least)
