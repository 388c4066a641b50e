"""Declarations of metrics, as data.

A family is a metric name with its type, help text and labels. Each program declares its families in one
table. The program's /metrics and the page docs/reference/metrics.md are generated from that table, so they
always match. The maximum number of series of the program also follows from the table.

Events that occur thousands of times a second are counted in plain Python (`Tally`) and exported at a scrape.
`Tally.observe` takes a tenth of a microsecond. A histogram of `prometheus_client` takes half a microsecond,
and finding its child for a label value takes more than one microsecond.
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


class MetricType(StrEnum):
    """The metric types of Prometheus."""

    COUNTER = "counter"
    GAUGE = "gauge"
    HISTOGRAM = "histogram"


@dataclass(frozen=True, slots=True, kw_only=True)
class Label:
    """A label, and the limit of its number of values.

    Attributes:
        name: the name as in PromQL.
        values: all possible values; empty if the values depend on the job or the cluster.
        bound: if `values` is empty, the kind of object for which each value stands, such as "release".
    """

    name: str
    values: tuple[str, ...] = ()
    bound: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Family:
    """All metrics that have one name.

    Attributes:
        name: the exported name, with its unit.
        kind: counter, gauge or histogram.
        meaning: the help text.
        labels: the labels; empty if the family has only one series.
        buckets: the upper bounds of a histogram's buckets, ascending, without infinity.
    """

    name: str
    kind: MetricType
    meaning: str
    labels: tuple[Label, ...] = ()
    buckets: tuple[float, ...] = ()

    @property
    def label_names(self) -> tuple[str, ...]:
        """Return the names of the labels, in order."""
        return tuple(label.name for label in self.labels)

    def combinations(self) -> Iterator[tuple[str, ...]]:
        """Yield every combination of label values; no combination if a label has no fixed values."""
        yield from product(*(label.values for label in self.labels))

    def series(self, sizes: Mapping[str, int]) -> int:
        """Return the maximum number of series; `sizes` maps `Label.bound` to the number of such objects."""
        values = prod(sizes[label.bound] if label.bound else len(label.values) for label in self.labels)
        samples = sum(1 for _ in self.tally().samples()) if self.kind is MetricType.HISTOGRAM else 1
        return values * samples

    def tally(self) -> Tally:
        """Return an empty tally with the histogram's buckets."""
        return Tally(self.buckets)

    def metric(self, values: Values) -> Metric:
        """Return the family as a metric of `prometheus_client`; it has a series for each of `values`."""
        made = Metric(self.name.removesuffix("_total"), self.meaning, self.kind)
        for given, value in values.items():
            labels = dict(zip(self.label_names, given, strict=True))
            parts = value.samples() if isinstance(value, Tally) else [("", {}, value)]
            for end, more, number in parts:
                made.add_sample(self.name + end, labels | more, number)
        return made


def counter(name: str, meaning: str, *labels: Label) -> Family:
    """Return a counter: a family whose values only rise."""
    return Family(name=name, kind=MetricType.COUNTER, meaning=meaning, labels=labels)


def gauge(name: str, meaning: str, *labels: Label) -> Family:
    """Return a gauge: a family whose values rise and fall."""
    return Family(name=name, kind=MetricType.GAUGE, meaning=meaning, labels=labels)


def histogram(name: str, meaning: str, buckets: tuple[float, ...], *labels: Label) -> Family:
    """Return a histogram: a family that counts observed values in buckets."""
    return Family(name=name, kind=MetricType.HISTOGRAM, meaning=meaning, labels=labels, buckets=buckets)


class Tally:
    """The number of observed values in each bucket; one thread may write while others read.

    Attributes:
        total: the sum of the observed values.
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
        """Yield the samples of a histogram: the suffix of the name, an additional label, and the value."""
        counts = list(accumulate(self._counts))
        for bound, count in zip((*self._bounds, "+Inf"), counts, strict=True):
            yield "_bucket", {"le": str(bound)}, count
        yield "_count", {}, counts[-1]  # OpenTelemetry's receiver drops a histogram that lacks `_count`
        # Negative values could make the sum fall. Prometheus' rate() and OpenTelemetry's receiver would
        # mistake a falling sum for a restart of the program.
        # Source: OpenMetrics 1.0, "Histogram"
        if self._bounds[0] >= 0:
            yield "_sum", {}, self.total


Values = Mapping[tuple[str, ...], float | Tally]  # keys: the values of the labels, in their order
