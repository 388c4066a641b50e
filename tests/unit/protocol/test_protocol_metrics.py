"""Metric families as data, and the time that one count takes; there are thousands of counts a second."""

import time

import pytest
from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.parser import text_string_to_metric_families
from prometheus_client.registry import Collector

from palaestra_protocol.metrics import Family, Label, MetricType, Tally

MOST_S = 2e-6


class Shown(Collector):
    """A family with values, for the registry of the Prometheus client."""

    def __init__(self, family, values):
        self.family, self.values = family, values

    def collect(self):
        """Yield the family with its values."""
        yield self.family.metric(self.values)

    def samples(self):
        """Return the samples of a scrape, by name and labels."""
        registry = CollectorRegistry()
        registry.register(self)
        text = generate_latest(registry).decode()
        return {
            (sample.name, *sample.labels.items()): sample.value
            for family in text_string_to_metric_families(text)
            for sample in family.samples
        }


def test_the_samples_of_a_counter_have_its_labels():
    """Prometheus' client appends `_total` to a counter's name, so the family passes it without the suffix."""
    colors = Label(name="color", values=("red", "blue"))
    family = Family(name="balls_total", kind=MetricType.COUNTER, meaning="Balls.", labels=(colors,))

    assert Shown(family, {("red",): 3}).samples() == {("balls_total", ("color", "red")): 3}


def test_a_family_without_a_value_is_there_with_its_meaning():
    """A value of 0 would be false, but a dashboard must still find the metric's name."""
    family = Family(name="height_metres", kind=MetricType.GAUGE, meaning="How high.")
    registry = CollectorRegistry()
    registry.register(Shown(family, {}))

    assert (
        generate_latest(registry).decode() == "# HELP height_metres How high.\n# TYPE height_metres gauge\n"
    )


def test_a_histogram_counts_what_is_up_to_each_bound():
    """As in Prometheus, a value that equals a bound counts in that bound's bucket."""
    family = Family(name="wait_seconds", kind=MetricType.HISTOGRAM, meaning="Wait.", buckets=(1.0, 2.0))
    tally = family.tally()
    for value in (0.5, 1.0, 1.5, 9.0):
        tally.observe(value)

    assert Shown(family, {(): tally}).samples() == {
        ("wait_seconds_bucket", ("le", "1.0")): 2,
        ("wait_seconds_bucket", ("le", "2.0")): 3,
        ("wait_seconds_bucket", ("le", "+Inf")): 4,
        ("wait_seconds_count",): 4,
        ("wait_seconds_sum",): 12.0,
    }


def test_a_histogram_of_what_may_be_negative_has_no_sum():
    """Prometheus takes a sum that decreases for a restart of the process.

    The count stays, because OpenTelemetry drops a histogram without a count.
    """
    family = Family(name="gain", kind=MetricType.HISTOGRAM, meaning="Gain.", buckets=(-1.0, 0.0))

    names = {name for name, *_ in Shown(family, {(): family.tally()}).samples()}
    assert names == {"gain_bucket", "gain_count"}


@pytest.mark.parametrize(
    ("kind", "buckets", "series"),
    [
        (MetricType.GAUGE, (), 6),
        (MetricType.HISTOGRAM, (1.0, 2.0), 6 * 5),
        (MetricType.HISTOGRAM, (-1.0, 2.0), 6 * 4),
    ],
)
def test_series_are_counted_by_labels_and_buckets(kind, buckets, series):
    """Prometheus stores a series for each combination of labels, and for each bucket of a histogram."""
    labels = (Label(name="color", values=("red", "blue")), Label(name="child", bound="child"))
    family = Family(name="x", kind=kind, meaning="X.", labels=labels, buckets=buckets)

    assert family.series({"child": 3}) == series


def test_to_count_a_step_costs_less_than_two_microseconds():
    """Up to 5,000 steps are counted per second. The test takes the best of ten runs, in processor time."""
    tally = Tally((0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0))

    def cost_s():
        before = time.thread_time()
        for _ in range(2000):
            tally.observe(0.003)
        return (time.thread_time() - before) / 2000

    assert min(cost_s() for _ in range(10)) < MOST_S
