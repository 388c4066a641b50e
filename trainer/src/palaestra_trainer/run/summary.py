"""Write the result of a run to summary.json; `palaestra run` prints this file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from palaestra_protocol.pod.status import SuccessInterval, Termination
from palaestra_protocol.whole_file import replace_file
from palaestra_trainer.job.configuration import Configuration
from palaestra_trainer.job.run_directory import RunDirectory, read_lines
from palaestra_trainer.run.best_record import last_evaluation, measured
from palaestra_trainer.run.telemetry.goodput import trained_share
from palaestra_trainer.run.telemetry.progress import Progress

_NEEDED = frozenset({"target", "steps", "success_rate", "success_interval"})  # fields of a finished run


def summarise(directory: RunDirectory, progress: Progress) -> dict[str, Any]:
    """Return the summary of a run that has completed its training.

    `success_rate`, `success_interval` and `mean_return` are results of the policy in model.zip; this policy
    learned for `best_step` steps. The values come from the confirmation of that policy, or else from its
    evaluation; without an evaluation they are null. Faults and restarts are those of all attempts.
    `duration_s` and the speed count all attempts too, and so does `goodput`, the seconds by cause.
    `trained_share` is the share of these seconds that was spent on training.
    """
    best = measured(directory)
    counters = progress.counted()
    return {
        "target": progress.target,
        "steps": progress.step,
        "episodes": counters.episodes,
        "success_rate": best.get("success_rate"),
        "success_interval": best.get("success_interval"),
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
    """Write summary.json, which marks the run as finished."""
    text = json.dumps(content, indent=2) + "\n"

    def write(path: Path) -> None:
        path.write_text(text, encoding="utf-8")

    replace_file(directory.summary, write)


def finished(directory: RunDirectory, configuration: Configuration) -> dict[str, Any] | None:
    """Return the summary of a finished run; None if it is not finished, or the job now has more steps."""
    try:
        content = json.loads(directory.summary.read_text(encoding="utf-8"))
    except (OSError, json.JSONDecodeError):
        return None
    if not isinstance(content, dict) or not content.keys() >= _NEEDED:
        return None
    if content["target"] < configuration.steps:
        return None
    return {name: value for name, value in content.items() if name != "event"}  # structlog adds this key


def last_word_of(summary: dict[str, Any], directory: RunDirectory) -> Termination:
    """Return the termination message of an attempt whose run, in `directory`, is already finished."""
    interval = summary["success_interval"]
    return Termination(
        step=summary["steps"],
        reason="Completed: before",
        success_rate=summary["success_rate"],
        success_interval=None if interval is None else SuccessInterval.from_json(interval),
        last_evaluation=last_evaluation(directory, summary["steps"]),
    )


def _rounded(share: float | None) -> float | None:
    return None if share is None else round(share, 4)
