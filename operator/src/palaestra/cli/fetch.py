"""`palaestra fetch`: copy a run's results from its volume to this machine."""

import argparse
from pathlib import Path

from palaestra.cli.cluster import cleaned_up, cluster_command, say
from palaestra.cli.subcommands import Commands
from palaestra.client import Client
from palaestra.client.client import FETCH_S
from palaestra.local.outcome import uses
from palaestra.local.report import complete_report
from palaestra.plan.resources import in_bytes
from palaestra_protocol.numbers import seconds, whole

FETCH = """\
Copies policy, evaluations, report and TensorBoard data of a run to <dir>/<job>/<replica>/. This folder must
not exist yet; it is written completely or not at all. The data is read in the pod that trains. If that pod
has ended, the command creates a pod that mounts the claim read-only, and deletes this pod afterwards. You
need the rights to create and delete pods and to run commands in them. If the run still trains, or if its
trainer was killed, the command writes the report here, provided that palaestra-trainer is installed.
"""


def add(commands: Commands) -> None:
    """Add the command."""
    parser = cluster_command(commands, "fetch", _fetch, FETCH)
    parser.add_argument("name", metavar="NAME", help="name of the job")
    parser.add_argument("--replica", metavar="N", type=whole(), default=0, help="number; default: 0")
    parser.add_argument("--dir", type=Path, default=Path("fetched"), help="target folder; default: fetched")
    parser.add_argument(
        "--max-size",
        metavar="SIZE",
        type=_size,
        help="limit for all files together, such as 500Mi; default: four times the requested volume",
    )
    parser.add_argument(
        "--timeout",
        metavar="S",
        type=seconds,
        default=FETCH_S,
        help="seconds for the whole copy; default: 600",
    )


def _fetch(client: Client, options: argparse.Namespace) -> int:
    with cleaned_up():
        folder = client.fetch(
            options.name,
            replica=options.replica,
            into=options.dir,
            deadline_s=options.timeout,
            most_bytes=options.max_size,
        )
    complete_report(folder)
    say([str(folder), *uses(folder)])
    return 0


def _size(text: str) -> int:
    """Return the bytes of a quantity of Kubernetes, above 0.

    Raises:
        ArgumentTypeError: the text is not a size.
    """
    try:
        size = in_bytes(text)
    except (ArithmeticError, LookupError):
        size = 0
    if size < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a size such as 500Mi or 2Gi")
    return size
