"""`palaestra try`: run a small job in a cluster and check that it succeeds."""

import argparse
import sys
from pathlib import Path

from palaestra.cli.cluster import REFUSED, cleaned_up, cluster_command, say
from palaestra.cli.files import job
from palaestra.cli.subcommands import Commands
from palaestra.client import Client, asked
from palaestra.errors import PalaestraError, SpecErrors
from palaestra.smoke_test import TrialFailed, attempt
from palaestra_protocol.numbers import seconds

TRY = """\
Creates the TrainingJob in FILE under a unique name, waits until it has ended, and deletes it in any case.
Prints a line for each phase and for each reason why a replica waits. Exits with 1 if the job did not succeed
in time.
"""


def add(commands: Commands) -> None:
    """Add the command."""
    parser = cluster_command(commands, "try", _try, TRY)
    parser.add_argument("file", metavar="FILE", type=Path, help="a TrainingJob")
    parser.add_argument(
        "--within",
        metavar="S",
        type=seconds,
        default=900.0,
        help="seconds within which the job must succeed, image pulls included; default: 900",
    )


def _try(client: Client, options: argparse.Namespace) -> int:
    try:
        tried = job(options.file)
    except SpecErrors as error:  # The file is wrong and no request was sent, so the exit code is 2.
        raise PalaestraError(str(error)) from error
    content = tried.model_dump(mode="json", by_alias=True, exclude_unset=True)
    content["metadata"].setdefault("namespace", client.namespace)
    try:
        with cleaned_up(), asked(None, client.namespace):
            attempt(client.api, content, within_s=options.within, report=lambda line: say([line]))
    except TrialFailed as failed:
        sys.stderr.write(f"{failed}\n")
        return REFUSED
    return 0
