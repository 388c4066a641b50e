"""What a run came to, as summary.json says it and `palaestra run` prints it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from palaestra_trainer.configuration import Configuration
from palaestra_trainer.goodput import trained_share
from palaestra_trainer.progress import Progress
from palaestra_trainer.run_directory import RunDirectory, read_lines, replace_file


def summarise(directory: RunDirectory, progress: Progress) -> dict[str, Any]:
    """Return the summary of a run that has ended.

    `success_rate` and `mean_return` are those of the best evaluation, whose
    policy model.zip is (null if nothing was evaluated); faults and restarts are
    of all attempts, and so are `duration_s`, the speed that follows from it, and
    `goodput`, its seconds by cause, of which `trained_share` trained.
    """
    best = max(
        read_lines(directory.evaluations),
        key=lambda line: (line["success_rate"], line["mean_return"]),
        default={},
    )
    counters = progress.counted()
    return {
        "target": progress.target,
        "steps": progress.step,
        "episodes": counters.episodes,
        "success_rate": best.get("success_rate"),
        "mean_return": best.get("mean_return"),
        "best_step": best.get("step"),
        "steps_per_second": round(progress.step / max(counters.seconds, 1e-9), 1),
        "duration_s": round(counters.seconds, 1),
        "faults": counters.broken,
        "restarts": counters.restarts,
        "recycled": counters.recycled,
        "steps_lost": counters.steps_lost,
        "goodput": {cause: round(seconds, 3) for cause, seconds in counters.goodput.items()},
        "trained_share": _rounded(trained_share(counters.goodput)),
        "attempts": sum(1 for _ in read_lines(directory.attempts)),
    }


def write_summary(directory: RunDirectory, content: dict[str, Any]) -> None:
    """Write summary.json, by which the run is finished."""
    text = json.dumps(content, indent=2) + "\n"

    def write(path: Path) -> None:
        path.write_text(text, encoding="utf-8")

    replace_file(directory.summary, write)


def finished(directory: RunDirectory, configuration: Configuration) -> dict[str, Any] | None:
    """Return the summary if the run is finished; None if it is not, or was prolonged since."""
    try:
        content = json.loads(directory.summary.read_text(encoding="utf-8"))
    except (OSError, json.JSONDecodeError):
        return None
    if not isinstance(content, dict) or not content.keys() >= {"target", "steps", "success_rate"}:
        return None
    if content["target"] < configuration.steps:
        return None
    return content


def _rounded(share: float | None) -> float | None:
    return None if share is None else round(share, 4)
