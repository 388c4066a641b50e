"""Record the end of an attempt: the termination message, end.json and the report.

The message is written first, because the operator needs the message and a report may take a second. If the
attempt was never recorded in the run directory, no report is written, because the folder may belong to
another run.
"""

from __future__ import annotations

from typing import Any

from palaestra_protocol.pod.status import Termination
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.reporting.write_report import report_end
from palaestra_trainer.run.telemetry.logs import last_lines
from palaestra_trainer.run.telemetry.progress import Progress
from palaestra_trainer.run.termination import End, write_last_word


def write_end(directory: RunDirectory, progress: Progress, end: End) -> None:
    """Write the termination message; if the attempt was recorded, write end.json and the report too."""
    write_last_word(last_word(progress, end))
    if progress.attempt is not None:
        report_end(directory, lambda: _record_of(progress, end))


def last_word(progress: Progress, end: End) -> Termination:
    """Return the termination message of an attempt that ends now; this function never blocks."""
    return Termination(
        step=progress.step,
        success_rate=progress.success_rate,
        success_interval=progress.success_interval,
        last_evaluation=progress.last_evaluation,
        reason=f"{end.reason}: {end.message}",
        last_checkpoint=progress.checkpoint,
        attempt=progress.attempt,
        restarts=progress.restarts(),
        log=last_lines(),
        faults=progress.faults(),
    )


def _record_of(progress: Progress, end: End) -> dict[str, Any]:
    """Return the content of end.json; this may block if a thread that holds a lock hangs."""
    interval, counters = progress.success_interval, progress.counted()
    return {
        "exit_code": int(end.code),
        "reason": f"{end.reason}: {end.message}",
        "step": progress.step,
        "success_rate": progress.success_rate,
        "success_interval": None if interval is None else interval.to_json(),
        "faults": counters.broken,
        "restarts": counters.restarts,
        "steps_lost": counters.steps_lost,
        "goodput": {cause: round(seconds, 3) for cause, seconds in counters.goodput.items()},
    }
