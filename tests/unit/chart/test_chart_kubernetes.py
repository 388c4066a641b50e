"""Every object of the chart meets the schemas of Kubernetes, with any combination of values.

The schemas are those of the oldest Kubernetes that the chart allows and of the newest known one. Objects of
the Prometheus Operator have no schema there; tests/integration/chart sends them to a real API server.
"""

import copy
import json
from functools import cache
from itertools import permutations, product

import kubernetes_validate
import pytest
import yaml

from tests.chart import readme
from tests.chart.helm import CHART, objects
from tests.chart.pairs import OTHERS, rows, together

OLDEST = yaml.safe_load((CHART / "Chart.yaml").read_text())["kubeVersion"].removeprefix(">=")
RELEASES = (OLDEST, kubernetes_validate.latest_version())
FOREIGN = {"PodMonitor", "PrometheusRule", "ServiceMonitor"}
ROWS = rows()


@pytest.mark.parametrize("row", ROWS, ids=range(len(ROWS)))
def test_every_object_meets_the_schemas_of_kubernetes(row):
    """The check is strict, because an API server silently drops an unknown, misspelled field."""
    made = [each for each in objects(together(row)) if each["kind"] not in FOREIGN]

    assert len(made) > len(FOREIGN)
    for each, release in product(made, RELEASES):
        meets(json.dumps(each), release)


@cache
def meets(text, release):
    """Raise an error if a release would refuse the object; the cache checks equal objects once."""
    kubernetes_validate.validate(json.loads(text), release, strict=True)


def test_a_misspelt_field_is_found(one):
    """Without this test, a check that accepts every object would pass unnoticed."""
    deployment = copy.deepcopy(one("default", "Deployment"))
    deployment["spec"]["template"]["spec"]["nodeSelektor"] = {}

    for release in RELEASES:
        with pytest.raises(kubernetes_validate.ValidationError, match="nodeSelektor"):
            kubernetes_validate.validate(deployment, release, strict=True)


def test_each_value_is_chosen_with_and_without_each_other():
    """A template that relies on the default of another value breaks when a user sets both values."""
    assert OTHERS.keys() == {value.path for value in readme.values(readme.VALUES.read_text())}
    assert ROWS[0] == ()
    for one, another in permutations(OTHERS, 2):
        chosen = {(one in row, another in row) for row in ROWS}
        assert chosen == {(False, False), (True, False), (False, True), (True, True)}
