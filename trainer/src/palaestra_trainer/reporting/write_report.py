"""Write a report: read the run directories, build the page, and replace the file atomically."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import structlog

from palaestra_protocol.whole_file import replace_file
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.reporting.page import page
from palaestra_trainer.reporting.read_run import read_run
from palaestra_trainer.reporting.run_data import RunData

log = structlog.get_logger(__name__)

END_S = 20.0  # longest time for the report at the end of a run


def write_report(runs: Sequence[RunDirectory], to: Path, others: Sequence[RunData] = ()) -> None:
    """Write the report of one run, or of several runs side by side.

    Args:
        runs: the run directories.
        to: the file to write.
        others: further data to report, such as those of deployments.

    Raises:
        OSError: the file could not be written; an old file is unchanged.
        ValueError: there are too many runs for one file.
    """
    text = page([*map(read_run, runs), *others])
    replace_file(to, lambda name: name.write_text(text, encoding="utf-8"))


def report_end(directory: RunDirectory, end: Callable[[], Mapping[str, Any]], wait_s: float = END_S) -> None:
    """Write the end of an attempt and its report into the run directory, in at most `wait_s` seconds.

    The run has ended even if its report cannot be written, so an error is only logged. If the disk does not
    respond, the end of the process is delayed by at most `wait_s` seconds.
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
    except Exception as error:  # an error in a report must not change how the run ends
        log.warning("report not written", path=str(directory.report), fact=str(error), exc_info=error)
    else:
        log.info("report", path=str(directory.report))
