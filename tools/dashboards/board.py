"""The parts that all dashboards share: variables, links to each other, the grid and the panels' numbers."""

from collections.abc import Sequence
from dataclasses import dataclass

from grafana_foundation_sdk.builders.dashboard import (
    Dashboard,
    DashboardLink,
    DatasourceVariable,
    QueryVariable,
    Row,
)
from grafana_foundation_sdk.models.common import TimeZoneBrowser
from grafana_foundation_sdk.models.dashboard import (
    Dashboard as DashboardModel,
)
from grafana_foundation_sdk.models.dashboard import (
    DashboardCursorSync,
    DashboardLinkType,
    VariableOption,
    VariableRefresh,
    VariableSort,
)

from tools.dashboards.panels import SOURCE, Panel

TAG = "palaestra"
EVERYTHING = ".+"  # the value of "All" in a matcher; it also matches namespaces that are created later


@dataclass(frozen=True, slots=True, kw_only=True)
class Variable:
    """A choice at the top of a dashboard: the values of a metric's label."""

    name: str
    metric: str
    label: str
    says: str

    def build(self) -> QueryVariable:
        """Return the choice in Grafana's model: at first, all values are chosen."""
        return (
            QueryVariable(self.name)
            .label(self.name.capitalize())
            .description(self.says)
            .datasource(SOURCE)
            .query(f"label_values({self.metric}, {self.label})")
            .refresh(VariableRefresh.ON_TIME_RANGE_CHANGED)
            .sort(VariableSort.ALPHABETICAL_ASC)
            .current(VariableOption(selected=True, text="All", value="$__all"))
            .multi(multi=True)
            .include_all(include_all=True)
            .all_value(EVERYTHING)
        )


@dataclass(frozen=True, slots=True)
class Section:
    """A row of panels under one heading."""

    title: str
    panels: Sequence[Panel]


@dataclass(frozen=True, slots=True, kw_only=True)
class Board:
    """One dashboard.

    Attributes:
        name: the name of its file, its title, and a part of its address in Grafana: /d/palaestra-<name>.
        says: the questions that it answers, and its readers.
        since: the start of the time range that it shows when it is opened, in Grafana's format: now-1h.
    """

    name: str
    says: str
    since: str
    variables: Sequence[Variable]
    sections: tuple[Section, ...]

    def build(self) -> DashboardModel:
        """Return the dashboard in Grafana's model."""
        made = (
            Dashboard(f"Palaestra / {self.name.capitalize()}")
            .uid(f"palaestra-{self.name}")
            .description(self.says)
            .tags([TAG])
            .time(self.since, "now")
            .timezone(TimeZoneBrowser)
            .refresh("30s")
            .tooltip(DashboardCursorSync.CROSSHAIR)
            .link(_others())
            .with_variable(_datasource())
        )
        for variable in self.variables:
            made.with_variable(variable.build())
        for section in self.sections:
            made.with_row(Row(section.title))
            for panel in section.panels:
                made.with_panel(panel.build())
        model = made.build()
        for number, placed in enumerate(model.panels or (), 1):
            placed.id_val = number
        return model


def _datasource() -> DatasourceVariable:
    return DatasourceVariable("datasource").label("Prometheus").type("prometheus")


def _others() -> DashboardLink:
    return (
        DashboardLink("Palaestra")
        .type(DashboardLinkType.DASHBOARDS)
        .tags([TAG])
        .as_dropdown(as_dropdown=True)
        .include_vars(include_vars=True)
        .keep_time(keep_time=True)
    )
