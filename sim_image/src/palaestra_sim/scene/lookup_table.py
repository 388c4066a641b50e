"""Lookup tables, which map the distance that a sensor detects to the value that it reports.

As in Webots, the response is linear between the rows and constant beyond both ends, with Gaussian noise as a
fraction of the response.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from functools import cache
from itertools import pairwise

Row = tuple[float, float, float]  # distance in meters, response, noise as a fraction of the response


class LookupTable:
    """The response of a sensor to a distance.

    Args:
        rows: the rows by increasing distance; without rows, the response is the distance itself.
    """

    __slots__ = ("_bases", "_distances", "_noisy", "_slopes", "rows")

    def __init__(self, rows: Sequence[Row]) -> None:
        self.rows = tuple(rows) or ((0.0, 0.0, 0.0), (1e9, 1e9, 0.0))
        self._noisy = any(row[2] for row in self.rows)
        self._distances = [row[0] for row in self.rows]
        # Interval i lies before row i; the first and the last interval are flat. In each interval, (value,
        # noise) = base + slope * distance.
        first, last = self.rows[0], self.rows[-1]
        self._bases = [(first[1], first[2])]
        self._slopes = [(0.0, 0.0)]
        for (d0, v0, n0), (d1, v1, n1) in pairwise(self.rows):
            slope = ((v1 - v0) / (d1 - d0), (n1 - n0) / (d1 - d0))
            self._slopes.append(slope)
            self._bases.append((v0 - slope[0] * d0, n0 - slope[1] * d0))
        self._bases.append((last[1], last[2]))
        self._slopes.append((0.0, 0.0))

    @property
    def reach_m(self) -> float:
        """The distance beyond which the response is constant."""
        return self._distances[-1]

    @property
    def noisy(self) -> bool:
        """Whether a response has noise."""
        return self._noisy

    @property
    def intervals(self) -> tuple[list[float], list[tuple[float, float]], list[tuple[float, float]]]:
        """The distances between the intervals; base and slope of (value, noise) in each interval."""
        return self._distances, self._bases, self._slopes

    @property
    def limits(self) -> tuple[float, float]:
        """The smallest and the largest response, without noise."""
        values = [row[1] for row in self.rows]
        return min(values), max(values)

    def response(self, distance_m: float, gauss: Callable[[float, float], float]) -> float:
        """Return the response to a distance, with noise drawn from `gauss(mean, deviation)`."""
        interval = bisect_right(self._distances, distance_m)
        base = self._bases[interval]
        slope = self._slopes[interval]
        value = base[0] + slope[0] * distance_m
        if self._noisy:
            return value * (1.0 + (base[1] + slope[1] * distance_m) * gauss(0.0, 1.0))
        return value


@cache
def lookup_table(*rows: Row) -> LookupTable:
    """Return the table of these rows; sensors with equal rows share one table."""
    return LookupTable(rows)
