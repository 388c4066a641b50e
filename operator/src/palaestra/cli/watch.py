"""`palaestra watch`: show the progress of a job until it has ended."""

import argparse
import sys
from datetime import UTC, datetime

from rich.console import Console
from rich.live import Live

from palaestra.api import TrainingJob
from palaestra.api.status import TERMINAL, Phase
from palaestra.cli.cluster import REFUSED, cluster_command, say
from palaestra.cli.subcommands import Commands
from palaestra.client import Client, why
from palaestra.client.wait_progress import current
from palaestra.view import History, live, progress
from palaestra_protocol.numbers import seconds

WATCH = """\
Shows the progress of a TrainingJob, with a line for each figure of each replica, until the job has ended;
then prints the result. Figures are as old as the job's status, which is written every 30 s. If the output is
not a terminal, it prints a line for each change. Reads the cluster and changes nothing. Exits with 1 if the
job failed or was deleted.
"""
WATCH_S = 604_800.0


def add(commands: Commands) -> None:
    """Add the command."""
    parser = cluster_command(commands, "watch", _watch, WATCH)
    parser.add_argument("name", metavar="NAME", help="name of the job")
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
    """Draw the job again each second, and return its last state."""
    history = History()
    job = client.get(options.name)
    with Live(
        get_renderable=lambda: live(job, history, datetime.now(UTC)), console=Console(), refresh_per_second=1
    ):
        for job in client.changes(options.name, deadline_s=options.timeout):
            history.add(job.status)
    return job


def _printed(client: Client, options: argparse.Namespace) -> TrainingJob:
    """Print a line for each visible change, and return the job's last state."""
    job, shown = client.get(options.name), ""
    for job in client.changes(options.name, deadline_s=options.timeout):
        parts = [
            f"{replica.index}: {replica.phase} {progress(replica)}".rstrip()
            for replica in job.status.replicas
        ]
        line = "; ".join([str(job.status.phase or "not reconciled by an operator yet"), *parts])
        if line != shown:
            say([line])
            shown = line
    return job
