"""Draw dashboards for the documentation: `python -m tests.monitoring [NAME…]`. All take ten minutes together.

    docs/images/training.png      Training, of manifests/examples/move-to-target.yaml to its end
    docs/images/simulators.png    Simulators, of three minutes in which simulators crash, hang and are slow

Prometheus scrapes the programs of each job, and then evaluates the queries of the dashboards.
"""

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.jobs import example
from tests.local_run import ROOT, LocalRun
from tests.monitoring import targets
from tests.monitoring.draw import Answers, draw, line
from tests.monitoring.prometheus import Prometheus, scraping
from tests.monitoring.questions import CHART, filled, panels, values_of

IMAGES = ROOT / "docs/images"
NAMESPACE = "robots"
OVER = "30s"
POINTS = 240
WARM_S = 10.0  # a rate over a shorter time is not meaningful


@dataclass(frozen=True, slots=True)
class Picture:
    """A job, the most seconds that it runs, and the title of its picture."""

    job: dict[str, Any]
    seconds: float
    title: str


def main(names: Sequence[str]) -> int:
    """Draw the dashboards with these names, or all dashboards."""
    for name in names or PICTURES:
        _picture(name, PICTURES[name])
    return 0


def _faulty() -> dict[str, Any]:
    """Return the example with faults, at rates that are high enough for a run of three minutes."""
    job = example("chaos")
    faults = "crash:probability=0.002 hang:probability=0.0005 slow:latency_ms=60,jitter_ms=40,probability=0.1"
    for group in job["spec"]["simulators"]:
        group["env"] = [{"name": "PALAESTRA_STUB_FAULTS", "value": faults}]
        group["restart"] = {"limit": 20, "withinSeconds": 120}
    return job


PICTURES = {
    "simulators": Picture(_faulty(), 180.0, "Simulators: a run whose simulators crash, hang and are slow"),
    "training": Picture(example("move-to-target"), 3600.0, "Training: a run that learns"),
}


def _picture(name: str, picture: Picture) -> None:
    """Run the job and draw one dashboard of it."""
    dashboard = json.loads((CHART / f"dashboards/{name}.json").read_text())
    with tempfile.TemporaryDirectory() as kept, LocalRun(Path(kept), picture.job) as run:
        data = Path(kept) / "prometheus"
        data.mkdir()
        scraped = targets.of_run(run, NAMESPACE)
        with scraping(scraped, data) as prometheus:
            began = time.time()
            with suppress(subprocess.TimeoutExpired):
                run.end(picture.seconds)
            answers = _asked(prometheus, dashboard, began, time.time())
    draw(dashboard, answers, picture.title, IMAGES / f"{name}.png")


def _asked(prometheus: Prometheus, dashboard: Mapping[str, Any], began: float, ended: float) -> Answers:
    """Return the data of a dashboard's panels between two points in time (Unix time)."""
    values = values_of(dashboard, OVER, f"{ended - began:.0f}s")
    step_s = max(1.0, (ended - began) / POINTS)
    since = began + WARM_S
    return {
        panel["id"]: [
            line(series, target["legendFormat"], began)
            for target in panel["targets"]
            for series in prometheus.over(filled(target["expr"], values), since, ended, step_s)
        ]
        for panel in panels(dashboard)
    }


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
