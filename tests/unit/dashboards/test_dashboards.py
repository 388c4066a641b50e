"""The dashboards and alerts, as far as tests can check them without Prometheus."""

import json
import re
from pathlib import Path

import pytest

from tests.monitoring.questions import DASHBOARDS, alerts, filled, panels, questions, values_of

ROOT = Path(__file__).parents[3]
METRICS = ROOT / "docs/reference/metrics.md"
TARGET = frozenset({"namespace", "pod", "container", "training_job", "replica", "simulator"})
OURS = re.compile(r"\bpalaestra_\w+")
COLUMNS = 24


@pytest.fixture(params=DASHBOARDS, ids=lambda path: path.stem)
def dashboard(request):
    """Return each dashboard as Grafana loads it."""
    return json.loads(request.param.read_text())


def test_a_panel_asks_a_question_and_says_what_to_do(dashboard):
    """The person on call did not build the dashboard and needs an explanation of each panel."""
    for panel in panels(dashboard):
        assert panel["title"].endswith("?")
        assert len(panel["description"]) > 60, panel["title"]
        assert panel["fieldConfig"]["defaults"]["unit"]


def test_panels_stand_beside_each_other_and_have_numbers_of_their_own(dashboard):
    """Grafana shows overlapping panels without an error."""
    taken = [
        (x, y)
        for place in (panel["gridPos"] for panel in dashboard["panels"])
        for x in range(place["x"], place["x"] + place["w"])
        for y in range(place["y"], place["y"] + place["h"])
    ]

    assert len(taken) == len(set(taken))
    assert max(x for x, _ in taken) < COLUMNS
    numbers = [panel["id"] for panel in dashboard["panels"]]
    assert len(numbers) == len(set(numbers))


def test_a_row_is_filled(dashboard):
    """A gap in a row shows that the author forgot a panel."""
    width = {}
    for panel in panels(dashboard):
        width[panel["gridPos"]["y"]] = width.get(panel["gridPos"]["y"], 0) + panel["gridPos"]["w"]

    assert set(width.values()) == {COLUMNS}


def test_a_query_uses_no_variable_that_its_dashboard_lacks(dashboard):
    """Grafana sends an unknown variable to Prometheus unchanged, and the panel stays empty."""
    values = values_of(dashboard, "30s", "1h")

    for panel in panels(dashboard):
        for target in panel["targets"]:
            assert "$" not in filled(target["expr"], values), panel["title"]


def test_every_metric_that_is_queried_is_documented():
    """If a metric is renamed, its panel stays empty and its alert never fires."""
    told = set(OURS.findall(METRICS.read_text()))
    asked = [question.expr for question in questions("30s", "1h")] + [rule["expr"] for rule in alerts()]
    suffixes = re.compile("_(bucket|sum|count)$")

    names = {name for expr in asked for name in OURS.findall(expr)}

    assert {name for name in names if not {name, suffixes.sub("", name)} & told} == set()


def test_a_query_keeps_no_label_that_its_metrics_lack_and_names_none_that_it_drops():
    """For a label that does not exist, Prometheus reports no error and Grafana shows an empty legend."""
    labels = labels_told()
    suffixes = re.compile("_(bucket|sum|count)$")

    for question in questions("30s", "1h"):
        names = {suffixes.sub("", name) for name in OURS.findall(question.expr)}
        known = TARGET.union({"le"}, *(labels.get(name, ()) for name in names))
        kept = {label for some in re.findall(r"by \(([^)]*)\)", question.expr) for label in some.split(", ")}
        named = set(re.findall(r"{{(\w+)}}", question.legend))
        assert kept <= known, question
        assert named <= (kept or known), question


def labels_told():
    """Return the labels of each metric in docs/reference/metrics.md."""
    rows = re.findall(r"^\| `(palaestra_\w+)` \|[^|]*\|([^|]*)\|", METRICS.read_text(), re.MULTILINE)
    return {name: re.findall(r"`(\w+)`:", labels) for name, labels in rows}


def test_an_alert_leads_to_what_to_do_about_it():
    """The receiver of a notification has only its link to find the remedy."""
    headings = re.findall(r"^## (\w+)$", (ROOT / "docs/howto/alerts.md").read_text(), re.MULTILINE)

    for rule in alerts():
        assert rule["alert"] in headings
        assert rule["annotations"]["runbook_url"] == f"docs/howto/alerts.md#{rule['alert'].lower()}"
