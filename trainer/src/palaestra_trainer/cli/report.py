"""`palaestra-report` writes a report of one or several runs, or a film of one run."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from palaestra_protocol.pod.enums import ExitCode
from palaestra_trainer.cli.program import leaving
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.reporting.run_data import RunData

REPORT = """\
Write the report of a run, or of several runs side by side, as one HTML file of at most 2.5 MB. The report
refers to no address, so it can be mailed. A running or damaged run is reported as far as its files can be
read. A file .mcap is the record of a deployment on a real robot, whose episodes the report replays.
With --film, write instead a film of the best recorded episode of one run, seen from above.

reads:
  RUN_DIR/*.json, *.jsonl, *.yaml, tensorboard/; or FILE.mcap
writes:
  the file; its path to standard output
"""
EXIT_CODES = """\
exit codes:
  0   done
  2   a run directory is wrong, has no recorded episode for --film, or FILE is neither .gif nor .mp4
  1   the file cannot be written
"""
FAILED = 1
BAG = ".mcap"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run `palaestra-report`; return its exit code."""
    parser = argparse.ArgumentParser(
        prog="palaestra-report",
        description=REPORT,
        epilog=EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "runs", type=Path, nargs="+", metavar="RUN_DIR", help="run directory, or record of a deployment"
    )
    to = parser.add_mutually_exclusive_group()
    to.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="default: report.html in RUN_DIR, FILE.html of FILE.mcap, report.html here for several",
    )
    to.add_argument(
        "--film", type=Path, metavar="FILE", help="animated GIF of at most 200 kB (.gif), or video (.mp4)"
    )
    chosen = parser.parse_args(arguments)
    records = [given for given in chosen.runs if BAG in given.suffixes]
    folders = [given for given in chosen.runs if given not in records]
    runs = [RunDirectory(folder.absolute()) for folder in folders]
    wrong = [given for given, run in zip(folders, runs, strict=True) if not run.configuration.exists()]
    if wrong:
        sys.stderr.writelines(f"{one}: has no training.yaml; give a run directory\n" for one in wrong)
        return ExitCode.CONFIGURATION
    if chosen.film is not None:
        return _film(chosen.runs, runs, chosen.film)
    return _report(runs, records, chosen.out)


def _report(runs: Sequence[RunDirectory], records: Sequence[Path], out: Path | None) -> int:
    """Write the report of runs and of the records of deployments."""
    from palaestra_trainer.reporting.write_report import write_report

    try:
        deployments = _deployments(records)
    except (ConfigurationError, OSError) as error:
        sys.stderr.write(f"{error}\n")
        return ExitCode.CONFIGURATION
    to = out or _usual_file(runs, records)
    return _written(to, "--out", lambda: write_report(runs, to, deployments))


def _deployments(records: Sequence[Path]) -> list[RunData]:
    """Return the data of deployments; import the libraries for bags only if there are records."""
    if not records:
        return []
    from palaestra_trainer.real_robots.deployment.read_record import read_record

    return [read_record(record) for record in records]


def _usual_file(runs: Sequence[RunDirectory], records: Sequence[Path]) -> Path:
    """Return the file of a report for which no file was named."""
    if len(records) == 1 and not runs:
        return records[0].with_suffix(".html")
    return (runs[0] if len(runs) == 1 else RunDirectory(Path())).report


def _film(given: Sequence[Path], runs: Sequence[RunDirectory], film: Path) -> int:
    """Write a film of a run; refuse several runs, and records of deployments."""
    if len(given) > 1 or not runs:
        sys.stderr.write(f"{film}: a film shows one run; give one run directory\n")
        return ExitCode.CONFIGURATION
    from palaestra_trainer.reporting.write_film import write_film

    try:
        return _written(film, "--film", lambda: write_film(runs[0], film))
    except ValueError as error:
        sys.stderr.write(f"{error}\n")
        return ExitCode.CONFIGURATION


def _written(to: Path, option: str, write: Callable[[], None]) -> int:
    """Write a file and print its path."""
    try:
        write()
    except OSError as error:
        sys.stderr.write(f"{to}: {error.strerror}; choose another file with {option}\n")
        return FAILED
    sys.stdout.write(f"{to}\n")
    return ExitCode.DONE


def report_and_leave() -> int:
    """Run `palaestra-report`."""
    return leaving(main)
