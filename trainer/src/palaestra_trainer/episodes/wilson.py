"""Compute the confidence interval of a success rate from a few episodes."""

from __future__ import annotations

from math import sqrt
from statistics import NormalDist

from palaestra_protocol.pod.status import SuccessInterval

CONFIDENCE = 0.95


def wilson(successes: int, episodes: int) -> SuccessInterval:
    """Return the Wilson score interval of a success rate, rounded to four decimals.

    Unlike the normal approximation, this interval stays within 0 and 1. Its width is positive even if all or
    no episodes succeed. Source: Wilson (1927), Journal of the American Statistical Association 22.

    Raises:
        ValueError: `episodes` is 0, or `successes` is not within 0 and `episodes`.
    """
    if not 0 <= successes <= episodes or episodes == 0:
        raise ValueError(f"{successes} of {episodes} episodes: not a share")
    z = NormalDist().inv_cdf((1 + CONFIDENCE) / 2)
    share = successes / episodes
    scale = 1 + z**2 / episodes
    middle = (share + z**2 / (2 * episodes)) / scale
    reach = z / scale * sqrt(share * (1 - share) / episodes + z**2 / (4 * episodes**2))
    low, high = max(middle - reach, 0.0), min(middle + reach, 1.0)
    return SuccessInterval(low=round(low, 4), high=round(high, 4), episodes=episodes)
