"""The programs' metrics have names by Prometheus' conventions, and a page is generated from them.

Source of the rules: https://prometheus.io/docs/practices/naming/ and the checks of `promtool check metrics`.
"""

import re
from pathlib import Path

import pytest

from palaestra_protocol.metrics import PREFIX, MetricType
from tests.tables import for_each
from tools.metrics import page

PAGE = Path(__file__).parents[3] / page.PAGE
FAMILIES = [family for program in page.PROGRAMS for family in program.families]
HOMES = {
    "operator": (
        "palaestra_operator_",
        "palaestra_jobs",
        "palaestra_job_",
        "palaestra_replica_",
        "palaestra_replicas_",
    ),
    "trainer": ("palaestra_trainer_", "palaestra_simulator_"),
    "sidecar": ("palaestra_sidecar_", "palaestra_simulator_"),
}
# These endings are units, or mark a value without a unit. UNITLESS lists the names with other endings.
ENDS = ("_seconds", "_bytes", "_ratio", "_steps", "_info", "_per_second", "_total")
UNITLESS = {
    "palaestra_jobs",
    "palaestra_operator_crd_outdated",
    "palaestra_replicas_waiting",
    "palaestra_operator_leader",
    "palaestra_operator_queue_depth",
    "palaestra_simulator_state",
    "palaestra_simulator_up",
    "palaestra_trainer_evaluation_episodes",
    "palaestra_trainer_evaluation_return_mean",
    "palaestra_trainer_episode_return",
    "palaestra_trainer_episode_return_mean",
    "palaestra_trainer_episode_return_quantile",
    "palaestra_trainer_exploration",
    "palaestra_trainer_learning_rate",
    "palaestra_trainer_loss",
    "palaestra_trainer_simulators",
}
OTHER_UNITS = re.compile(r"_(ms|milliseconds|minutes|hours|kb|mb|gb|kilobytes|megabytes|percent)(_|$)")
# Prometheus or its operator adds these labels to a target. It renames a program's label of the same name.
OF_TARGETS = {
    "job", "instance", "namespace", "pod", "container", "endpoint", "service", "training_job", "replica",
}  # fmt: skip

each_family = for_each("family", FAMILIES)


def test_a_name_is_declared_once():
    """A name with two declarations would mean something else in each program."""
    names = [family.name for family in FAMILIES]

    assert sorted(names) == sorted(set(names))


@pytest.mark.parametrize("program", page.PROGRAMS, ids=lambda program: program.name)
def test_a_name_tells_its_home(program):
    """The prefix shows which program exports a metric, and that it belongs to this project."""
    assert all(family.name.startswith(PREFIX) for family in program.families)
    assert [it.name for it in program.families if not it.name.startswith(HOMES[program.name])] == []


@each_family
def test_a_counter_and_nothing_else_ends_in_total(family):
    """The author of a query sees from the name whether the metric needs `rate`."""
    assert family.name.endswith("_total") is (family.kind is MetricType.COUNTER)


@each_family
def test_a_name_has_a_base_unit_or_none(family):
    """If all metrics use seconds, bytes and ratios, no query has to convert a unit."""
    assert re.fullmatch(r"[a-z][a-z0-9_]*[a-z0-9]", family.name)
    assert not OTHER_UNITS.search(family.name)
    assert family.name.endswith(ENDS) is not (family.name in UNITLESS)


@each_family
def test_a_name_ends_in_nothing_that_prometheus_adds(family):
    """Prometheus adds `_sum`, `_count` and `_bucket` to a histogram.

    The type of a metric is not part of its name.
    """
    assert not re.search(r"_(sum|count|bucket|created|counter|gauge|histogram)(_|$)", family.name)


@each_family
def test_a_help_text_is_a_line_that_tells_something(family):
    """Grafana's explorer shows this text next to the metric."""
    assert re.fullmatch(r"[A-Z1].{14,118}\.", family.meaning)


@each_family
def test_labels_are_bounded_and_not_those_of_a_target(family):
    """Prometheus stores a series for each value of a label.

    So a label has a fixed list of values, or names objects whose number is small.
    """
    for label in family.labels:
        assert re.fullmatch(r"[a-z][a-z_]*", label.name)
        assert label.name not in OF_TARGETS | {"le", "quantile"}  # le and quantile are Prometheus' own
        assert label.values or label.bound in page.SIZES


@each_family
def test_a_histogram_has_ascending_buckets_and_nothing_else_has_any(family):
    """Each trainer has one series for each bucket, so the number of buckets is limited."""
    buckets = family.buckets

    assert bool(buckets) is (family.kind is MetricType.HISTOGRAM)
    assert list(buckets) == sorted(set(buckets))
    assert len(buckets) <= 30


def test_the_page_has_every_family_and_no_other():
    """The page is generated from the same tables, but a person reads the page.

    So the test reads the page too.
    """
    named = re.findall(r"^\| `(palaestra_\w+)` \|", PAGE.read_text(), re.MULTILINE)

    assert named == [family.name for family in FAMILIES]


def test_the_queries_of_the_page_name_metrics_that_there_are():
    """If a metric is renamed, the test finds its old name on the page."""
    text = PAGE.read_text()
    known = {family.name for family in FAMILIES}

    words = set(re.findall(r"\bpalaestra_\w+", text))
    assert {re.sub(r"_(bucket|sum|count)$", "", word) for word in words} == known


def test_the_series_of_a_large_cluster_are_few_enough_for_one_prometheus():
    """A Prometheus server handles a few million series, also with a thousand jobs at once."""
    assert sum(program.series * program.count for program in page.PROGRAMS) < 600_000
