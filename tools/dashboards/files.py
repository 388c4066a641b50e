"""The dashboards as files of the chart."""

import json
from pathlib import Path

from grafana_foundation_sdk.cog.encoder import JSONEncoder
from grafana_foundation_sdk.models.dashboard import Dashboard as DashboardModel

from tools.dashboards import fleet, operators, simulators, training

FOLDER = Path("charts/palaestra/dashboards")
BOARDS = (training.board, simulators.board, operators.board, fleet.board)


def generated_files() -> dict[Path, str]:
    """Return each dashboard's JSON by its path below the repository."""
    return {FOLDER / f"{made.name}.json": _text(made.build()) for made in (board() for board in BOARDS)}


def _text(model: DashboardModel) -> str:
    return json.dumps(model, cls=JSONEncoder, indent=2, sort_keys=True) + "\n"
