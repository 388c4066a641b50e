"""`palaestra report`: write the report of runs as one HTML file."""

import argparse
from pathlib import Path

from palaestra.cli.subcommands import Commands, command
from palaestra.local.report import PROGRAM
from palaestra.local.trainer_program import run_program

REPORT = """\
Writes the report of the run directory RUN, or of several runs side by side, as one HTML file of at most
2.5 MB: the job and the versions, curves with intervals, recorded episodes, every fault, the time by activity,
checkpoints, and the command that repeats the run. The file refers to no address, so it can be mailed and
opened anywhere. `palaestra run` and the trainer of a cluster write the report at the end of each run; this
command writes it again, also for a run that still trains.

RUN may also be the record of a deployment on a real robot, FILE.mcap. The report then replays its episodes.

With --film FILE, the command instead writes the best recorded episode of one run, seen from above.
"""
EXIT_CODES = """\
exit codes:
  0    done
  1    the file cannot be written
  2    RUN is not a run directory, or has no recorded episode for --film; FILE is neither .gif nor .mp4; or
       palaestra-trainer is not installed
  130  ended by Ctrl-C
"""


def add(commands: Commands) -> None:
    """Add the command."""
    parser = command(commands, "report", _report, REPORT, EXIT_CODES)
    parser.add_argument(
        "runs",
        metavar="RUN",
        type=Path,
        nargs="+",
        help="run directory, such as runs/<job>/<replica>; or FILE.mcap",
    )
    to = parser.add_mutually_exclusive_group()
    to.add_argument(
        "--out",
        metavar="FILE",
        type=Path,
        help="default: RUN/report.html; of FILE.mcap: FILE.html; of several: ./report.html",
    )
    to.add_argument(
        "--film",
        metavar="FILE",
        type=Path,
        help="animated GIF of at most 200 kB (FILE.gif), or video (FILE.mp4, needs palaestra-trainer[film])",
    )


def _report(options: argparse.Namespace) -> int:
    chosen = {"--out": options.out, "--film": options.film}
    to = [text for option, file in chosen.items() if file is not None for text in (option, str(file))]
    return run_program([PROGRAM, *map(str, options.runs), *to])
