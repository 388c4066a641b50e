"""The Grafana dashboards of the chart, as typed Python; `make golden` writes their JSON.

Each dashboard has a module with its queries; `panels` defines the look of every panel. No installed program
imports this package; only `make golden` and tests use it.
"""

from tools.dashboards.files import generated_files

__all__ = ["generated_files"]
