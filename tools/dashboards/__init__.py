"""The Grafana dashboards of the chart, as typed Python; `make golden` writes their JSON.

Each dashboard has a module with its queries; `panels` has the look of every panel. The operator never
imports this package: it is a tool, needed where the JSON is made and nowhere else.
"""

from tools.dashboards.files import generated_files

__all__ = ["generated_files"]
