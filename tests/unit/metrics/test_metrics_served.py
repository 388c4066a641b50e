"""The histograms of operator and trainer follow the rules of Prometheus' text format and of OpenMetrics.

Sources: https://prometheus.io/docs/instrumenting/exposition_formats/ and OpenMetrics 1.0, "Histogram". Some
readers are stricter than Prometheus: OpenTelemetry's receiver drops a histogram without a `_count`.
"""

from collections import defaultdict
from math import inf

import pytest
from prometheus_client import generate_latest
from prometheus_client.parser import text_string_to_metric_families

from palaestra.operator import metric_definitions as of_operator
from palaestra.operator.metrics import Metrics
from palaestra_protocol.metrics import MetricType
from palaestra_trainer.run.telemetry import metric_definitions as of_trainer
from palaestra_trainer.run.telemetry.metrics import registry
from palaestra_trainer.run.telemetry.progress import Progress


def operator():
    """Return the metrics of an operator that has counted one event of each kind."""
    metrics = Metrics()
    metrics.request("get", "pods", 200, 0.02)
    metrics.waited(0.3)
    metrics.reconciled.labels("done").observe(0.1)
    return metrics.text().decode()


def trainer():
    """Return the metrics of a trainer with episodes of negative and positive returns, and a checkpoint."""
    progress = Progress(100, [("collect-0", "Collect")], lambda: 0.0)
    progress.collected(7, [{"episode": {"r": number, "l": 3}} for number in (-2000.0, -7.0, 0.5, 3.0)])
    progress.figures.saves.observe(0.2)
    return generate_latest(registry(progress)).decode()


def series(text):
    """Return the samples of each histogram series, by family and labels.

    The samples of a series are a dict from the suffix or the bucket's bound to the value.
    """
    found = defaultdict(dict)
    for family in text_string_to_metric_families(text):
        for sample in family.samples if family.type == "histogram" else ():
            labels = dict(sample.labels)
            part = float(labels.pop("le")) if sample.name.endswith("_bucket") else sample.name
            found[family.name, *labels.values()][part] = sample.value
    return found


@pytest.mark.parametrize(("served", "declared"), [(operator, of_operator), (trainer, of_trainer)])
def test_each_histogram_has_the_samples_that_a_strict_reader_needs(served, declared):
    """A strict reader needs ascending buckets up to infinity, and a `_count` that equals the last bucket.

    It also needs a `_sum`, except for a histogram whose sum may decrease.
    """
    text = served()
    found = series(text)

    names = {family.name for family in declared.FAMILIES if family.kind is MetricType.HISTOGRAM}
    assert {f"# TYPE {name} histogram" for name in names} <= set(text.splitlines())
    assert {name for name, *_ in found} >= names - {"palaestra_simulator_step_duration_seconds"}
    for (name, *_), samples in found.items():
        bounds = sorted(part for part in samples if isinstance(part, float))
        counts = [samples[bound] for bound in bounds]
        others = {part.removeprefix(name) for part in samples if isinstance(part, str)}
        assert bounds[-1] == inf
        assert counts == sorted(counts)
        assert counts[-1] == samples[f"{name}_count"]
        assert others == ({"_count"} if bounds[0] < 0 else {"_count", "_sum"})


def test_an_episode_of_each_return_is_in_the_count():
    """A return below the lowest bound counts too."""
    samples = series(trainer())["palaestra_trainer_episode_return",]

    assert samples["palaestra_trainer_episode_return_count"] == 4
    assert (samples[-1000.0], samples[-5.0], samples[inf]) == (1, 2, 4)
