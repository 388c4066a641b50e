"""The queries of the dashboards and alerts, read from the chart and completed as Grafana does."""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

CHART = Path(__file__).parents[2] / "charts/palaestra"
DASHBOARDS = sorted((CHART / "dashboards").glob("*.json"))
ALERTS = CHART / "alerts.yaml"
SELECTOR = re.compile(r"palaestra_\w+(?:{[^}]*})?")
EVERYTHING = ".+"  # the value that Grafana sends for "All"


@dataclass(frozen=True, slots=True)
class Question:
    """A query of a dashboard's panel or of an alert."""

    dashboard: str
    panel: str
    expr: str
    legend: str


def questions(over: str, shown: str) -> Iterator[Question]:
    """Yield every query of every panel, for all namespaces, jobs and replicas.

    Args:
        over: the time range of rates, in the form of Prometheus: 30s.
        shown: the whole time range of the dashboard.
    """
    for file in DASHBOARDS:
        dashboard = json.loads(file.read_text())
        values = values_of(dashboard, over, shown)
        for panel in panels(dashboard):
            for target in panel["targets"]:
                yield Question(
                    file.stem, panel["title"], filled(target["expr"], values), target["legendFormat"]
                )


def looked_at() -> Iterator[Question]:
    """Yield every metric selector in the expressions of the alerts."""
    for rule in alerts():
        for selector in SELECTOR.findall(rule["expr"]):
            yield Question("alerts", rule["alert"], selector, "")


def panels(dashboard: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the panels of a dashboard without its headings."""
    return [panel for panel in dashboard["panels"] if panel["type"] != "row"]


def values_of(dashboard: Mapping[str, Any], over: str, shown: str) -> dict[str, str]:
    """Return the value of each variable in a query if the user selects all values."""
    chosen = {variable["name"]: EVERYTHING for variable in dashboard["templating"]["list"]}
    return {**chosen, "__rate_interval": over, "__range": shown}


def filled(expr: str, values: Mapping[str, str]) -> str:
    """Return a query with its variables replaced."""
    for name in sorted(values, key=len, reverse=True):  # $job is a prefix of $job_namespace
        expr = expr.replace(f"${name}", values[name])
    return expr


def alerts() -> list[dict[str, Any]]:
    """Return the alerting rules."""
    return [rule for group in yaml.safe_load(ALERTS.read_text())["groups"] for rule in group["rules"]]
