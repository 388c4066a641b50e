"""`palaestra watch`: a job as it moves, until it has ended."""

import argparse
import sys
from datetime import UTC, datetime

from rich.console import Console
from rich.live import Live

from palaestra.api import TrainingJob
from palaestra.api.status import TERMINAL, Phase
from palaestra.cli.cluster import REFUSED, cluster_command, say
from palaestra.cli.parsing import Commands
from palaestra.client import Client, why
from palaestra.client.reading import current
from palaestra.view import History, live, progress
from palaestra_sim.typed import seconds

WATCH = """\
Shows a TrainingJob as it moves, with a line for each figure of each replica, until it has ended; then says
how. Figures are as old as the job's status, which is written every 30 s. Where the output is no terminal, a
line for each change. Reads the cluster; writes nothing but its output. A job that failed
or was deleted ends it with 1.
"""
WATCH_S = 604_800.0


def add(commands: Commands) -> None:
    """Add the command."""
    parser = cluster_command(commands, "watch", _watch, "show a job as it moves", WATCH)
    parser.add_argument("name", metavar="NAME", help="of the job")
    parser.add_argument(
        "--timeout", metavar="S", type=seconds, default=WATCH_S, help="seconds to watch; default: a week"
    )


def _watch(client: Client, options: argparse.Namespace) -> int:
    show = _drawn if sys.stdout.isatty() else _printed
    last = show(client, options)
    if not current(last) or last.status.phase not in TERMINAL:
        say([f"{options.name}: was deleted"])
        return REFUSED
    say([f"{options.name}: {last.status.phase}; {why(last.status)}".rstrip("; ")])
    return REFUSED if last.status.phase is Phase.FAILED else 0


def _drawn(client: Client, options: argparse.Namespace) -> TrainingJob:
    """Draw the job again each second, and return it as it was last."""
    history = History()
    job = client.get(options.name)
    with Live(
        get_renderable=lambda: live(job, history, datetime.now(UTC)), console=Console(), refresh_per_second=1
    ):
        for job in client.changes(options.name, deadline_s=options.timeout):
            history.add(job.status)
    return job


def _printed(client: Client, options: argparse.Namespace) -> TrainingJob:
    """Print a line for each change that a person would notice, and return the job as it was last."""
    job, told = client.get(options.name), ""
    for job in client.changes(options.name, deadline_s=options.timeout):
        parts = [f"{each.index}: {each.phase} {progress(each)}".rstrip() for each in job.status.replicas]
        line = "; ".join([str(job.status.phase or "not seen by an operator yet"), *parts])
        if line != told:
            say([line])
            told = line
    return job
