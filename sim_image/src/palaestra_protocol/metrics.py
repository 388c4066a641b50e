"""What a family of metrics is, as data.

Each program declares its families in one table; its /metrics and docs/metrics.md are made from that. So
the page cannot differ from what is served, and how many series a program has can be computed.

What happens thousands of times a second is counted in plain Python (`Tally`) and read when somebody asks:
that takes a tenth of a microsecond, where `prometheus_client`'s histograms need half of one, and more than
one to find a label's.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import accumulate, product
from math import prod

from prometheus_client.metrics_core import Metric

PREFIX = "palaestra_"


class Kind(StrEnum):
    """Types of Prometheus."""

    COUNTER = "counter"
    GAUGE = "gauge"
    HISTOGRAM = "histogram"


@dataclass(frozen=True, slots=True, kw_only=True)
class Label:
    """A label, and what bounds it.

    Attributes:
        name: as in PromQL.
        values: all that it may have; none: they depend on job or cluster.
        bound: what there is one value for, in words, where that is not each of `values`.
    """

    name: str
    values: tuple[str, ...] = ()
    bound: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Family:
    """The metrics of one name.

    Attributes:
        name: as served, with its unit.
        meaning: the help text.
        labels: none: there is one value.
        buckets: upper bounds of a histogram, ascending; that of the last bucket, infinity, is left out.
    """

    name: str
    kind: Kind
    meaning: str
    labels: tuple[Label, ...] = ()
    buckets: tuple[float, ...] = ()

    @property
    def label_names(self) -> tuple[str, ...]:
        """Names of the labels, in order."""
        return tuple(label.name for label in self.labels)

    def combinations(self) -> Iterator[tuple[str, ...]]:
        """Yield every combination of label values; none where some are not known beforehand."""
        yield from product(*(label.values for label in self.labels))

    def series(self, sizes: Mapping[str, int]) -> int:
        """Return how many series the family has at most, with `sizes` for the bounds of its labels."""
        values = prod(sizes[label.bound] if label.bound else len(label.values) for label in self.labels)
        samples = sum(1 for _ in self.tally().samples()) if self.kind is Kind.HISTOGRAM else 1
        return values * samples

    def tally(self) -> Tally:
        """Return a tally with the histogram's buckets, of nothing yet."""
        return Tally(self.buckets)

    def metric(self, values: Values) -> Metric:
        """Return the family with these values; one that is missing is not known."""
        made = Metric(self.name.removesuffix("_total"), self.meaning, self.kind)
        for given, value in values.items():
            labels = dict(zip(self.label_names, given, strict=True))
            parts = value.samples() if isinstance(value, Tally) else [("", {}, value)]
            for end, more, number in parts:
                made.add_sample(self.name + end, labels | more, number)
        return made


def counter(name: str, meaning: str, *labels: Label) -> Family:
    """Return a family whose values only rise."""
    return Family(name=name, kind=Kind.COUNTER, meaning=meaning, labels=labels)


def gauge(name: str, meaning: str, *labels: Label) -> Family:
    """Return a family whose values rise and fall."""
    return Family(name=name, kind=Kind.GAUGE, meaning=meaning, labels=labels)


def histogram(name: str, meaning: str, buckets: tuple[float, ...], *labels: Label) -> Family:
    """Return a family that tells how many values were how large."""
    return Family(name=name, kind=Kind.HISTOGRAM, meaning=meaning, labels=labels, buckets=buckets)


class Tally:
    """How many of the observed values fell into each bucket; written by one thread, read by any.

    Attributes:
        total: sum of the values.
    """

    __slots__ = ("_bounds", "_counts", "total")

    def __init__(self, bounds: Sequence[float]) -> None:
        self._bounds = tuple(bounds)
        self._counts = [0] * (len(bounds) + 1)
        self.total = 0.0

    def observe(self, value: float) -> None:
        """Count a value."""
        self._counts[bisect_left(self._bounds, value)] += 1
        self.total += value

    def samples(self) -> Iterator[tuple[str, dict[str, str], float]]:
        """Yield what a histogram is told as: the end of its name, a label more, and the value."""
        counts = list(accumulate(self._counts))
        for bound, count in zip((*self._bounds, "+Inf"), counts, strict=True):
            yield "_bucket", {"le": str(bound)}, count
        if self._bounds[0] >= 0:  # a sum that may fall is none. Source: OpenMetrics 1.0, "Histogram"
            yield "_count", {}, counts[-1]
            yield "_sum", {}, self.total


Values = Mapping[tuple[str, ...], float | Tally]  # by the values of the labels, in their order
