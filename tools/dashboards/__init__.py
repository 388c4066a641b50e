"""The Grafana dashboards of the chart, as typed Python; `make golden` writes their JSON.

What is asked of Prometheus is in one module a dashboard; how it looks, in `panels`. The operator never
imports this package: it is a tool, needed where the JSON is made and nowhere else.
"""

from tools.dashboards.files import generated_files

__all__ = ["generated_files"]
