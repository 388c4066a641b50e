"""Write a report: read run directories, make the page, and replace the file as a whole."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import structlog

from palaestra_trainer.job.run_directory import RunDirectory, replace_file
from palaestra_trainer.reporting.page import page
from palaestra_trainer.reporting.read_run import read_run

log = structlog.get_logger(__name__)

END_S = 20.0  # the most time for the report at the end of a run


def write_report(runs: Sequence[RunDirectory], to: Path) -> None:
    """Write the report of one run, or of several side by side.

    Raises:
        OSError: the file could not be written; an old one is unchanged.
        ValueError: there are too many runs for one file.
    """
    text = page([read_run(run) for run in runs])
    replace_file(to, lambda name: name.write_text(text, encoding="utf-8"))


def report_end(directory: RunDirectory, end: Callable[[], Mapping[str, Any]], wait_s: float = END_S) -> None:
    """Write the end of an attempt and its report into the run directory, in at most `wait_s` seconds.

    A run has ended whether or not its report can be written, so an error is only logged. A disk that does not
    answer delays the end of the process by no more than that time.
    """
    writer = threading.Thread(target=_write, args=(directory, end), name="report", daemon=True)
    writer.start()
    writer.join(wait_s)
    if writer.is_alive():
        log.warning("report not written in time", path=str(directory.report), after_s=wait_s)


def _write(directory: RunDirectory, end: Callable[[], Mapping[str, Any]]) -> None:
    try:
        text = json.dumps(end(), indent=1) + "\n"
        replace_file(directory.end, lambda name: name.write_text(text, encoding="utf-8"))
        write_report([directory], directory.report)
    except Exception as error:  # no mistake in a report may change how a run ends
        log.warning("report not written", path=str(directory.report), fact=str(error), exc_info=error)
    else:
        log.info("report", path=str(directory.report))
