"""A panel: a question, the queries that answer the question, and the look of the answer.

Each title is a question; the description explains how to read the answer and what to do. The four looks are
lines, stacked shares, single figures, and the distribution of values over time.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum, auto
from typing import Final

from grafana_foundation_sdk.builders.common import (
    GraphThresholdsStyleConfig,
    ReduceDataOptions,
    StackingConfig,
    VizLegendOptions,
    VizTooltipOptions,
)
from grafana_foundation_sdk.builders.dashboard import ThresholdsConfig
from grafana_foundation_sdk.builders.heatmap import Panel as Heatmap
from grafana_foundation_sdk.builders.heatmap import YAxisConfig
from grafana_foundation_sdk.builders.prometheus import Dataquery
from grafana_foundation_sdk.builders.stat import Panel as Stat
from grafana_foundation_sdk.builders.timeseries import Panel as Timeseries
from grafana_foundation_sdk.models.common import (
    GraphTresholdsStyleMode,
    LegendDisplayMode,
    LegendPlacement,
    SortOrder,
    StackingMode,
    TooltipDisplayMode,
    VisibilityMode,
)
from grafana_foundation_sdk.models.dashboard import DataSourceRef, Threshold, ThresholdsMode
from grafana_foundation_sdk.models.prometheus import PromQueryFormat

SOURCE: Final = DataSourceRef(type_val="prometheus", uid="$datasource")
HEIGHT: Final = 8


class Look(Enum):
    """The look of the answer to a question."""

    LINES = auto()
    SHARES = auto()
    FIGURES = auto()
    SPREAD = auto()


Built = Timeseries | Stat | Heatmap


@dataclass(frozen=True, slots=True)
class Query:
    """A query to Prometheus, and the name of each series of its result; `{{x}}` is the label x."""

    expr: str
    legend: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Panel:
    """One panel.

    Attributes:
        question: its title.
        says: how to read the answer, and what to do.
        unit: the unit of all values, from `grafana_foundation_sdk.models.units`.
        least, most: the ends of the axis; None: the least or largest value.
        alarm: the least value that is drawn red.
        width: number of columns; a row has 24.
    """

    question: str
    says: str
    unit: str
    queries: tuple[Query, ...]
    look: Look = Look.LINES
    least: float | None = None
    most: float | None = None
    alarm: float | None = None
    width: int = 8

    def build(self) -> Built:
        """Return the panel in the model of Grafana's SDK."""
        built = _LOOKS[self.look](self)
        built.title(self.question).description(self.says)
        built.datasource(SOURCE).unit(self.unit).span(self.width).height(HEIGHT)
        for number, query in enumerate(self.queries):
            built.with_target(_target(query, chr(ord("A") + number), self.look))
        return built


def _lines(panel: Panel) -> Timeseries:
    built = Timeseries().line_width(2).fill_opacity(8).legend(_legend()).tooltip(_tooltip())
    built.show_points(VisibilityMode.AUTO)
    if panel.least is not None:
        built.min(panel.least)
    if panel.most is not None:
        built.max(panel.most)
    if panel.alarm is not None:
        built.thresholds(_thresholds(panel.alarm)).thresholds_style(
            GraphThresholdsStyleConfig().mode(GraphTresholdsStyleMode.LINE)
        )
    return built


def _shares(panel: Panel) -> Timeseries:
    return _lines(panel).fill_opacity(60).line_width(0).stacking(StackingConfig().mode(StackingMode.NORMAL))


def _figures(panel: Panel) -> Stat:
    built = Stat().reduce_options(ReduceDataOptions().calcs(["lastNotNull"]))
    if panel.alarm is not None:
        built.thresholds(_thresholds(panel.alarm))
    return built


def _spread(panel: Panel) -> Heatmap:
    return Heatmap().calculate(calculate=False).y_axis(YAxisConfig().unit(panel.unit))


_LOOKS: Mapping[Look, Callable[[Panel], Built]] = {
    Look.LINES: _lines,
    Look.SHARES: _shares,
    Look.FIGURES: _figures,
    Look.SPREAD: _spread,
}


def _target(query: Query, name: str, look: Look) -> Dataquery:
    target = Dataquery().ref_id(name).expr(query.expr).legend_format(query.legend).datasource(SOURCE)
    if look is Look.FIGURES:
        return target.instant()
    if look is Look.SPREAD:
        target.format(PromQueryFormat.HEATMAP)
    return target.range()


def _legend() -> VizLegendOptions:
    return (
        VizLegendOptions()
        .display_mode(LegendDisplayMode.LIST)
        .placement(LegendPlacement.BOTTOM)
        .show_legend(show_legend=True)
    )


def _tooltip() -> VizTooltipOptions:
    return VizTooltipOptions().mode(TooltipDisplayMode.MULTI).sort(SortOrder.DESCENDING)


def _thresholds(alarm: float) -> ThresholdsConfig:
    steps = [Threshold(value=None, color="green"), Threshold(value=alarm, color="red")]
    return ThresholdsConfig().mode(ThresholdsMode.ABSOLUTE).steps(steps)
