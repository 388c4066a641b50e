"""`palaestra fetch`: a run's results, from its volume to this machine."""

import argparse
from pathlib import Path

from palaestra.cli.cluster import cleaned_up, cluster_command, say
from palaestra.cli.parsing import Commands
from palaestra.client import Client
from palaestra.client.client import FETCH_S
from palaestra.local.outcome import uses
from palaestra_sim.typed import seconds, whole

FETCH = """\
Copies policy, evaluations and TensorBoard data of a run to <dir>/<job>/<replica>/, which must not be there
yet; it is written whole or not at all. Reads them in the pod that trains, or, when that has ended, in a
pod that mounts the claim for reading and is deleted afterwards. Needs the rights to make and delete pods
and to run commands in them.
"""


def add(commands: Commands) -> None:
    """Add the command."""
    parser = cluster_command(commands, "fetch", _fetch, "copy the results of a run", FETCH)
    parser.add_argument("name", metavar="NAME", help="of the job")
    parser.add_argument("--replica", metavar="N", type=whole(), default=0, help="default: 0")
    parser.add_argument("--dir", type=Path, default=Path("fetched"), help="default: fetched")
    parser.add_argument(
        "--timeout", metavar="S", type=seconds, default=FETCH_S, help="seconds for all of it; default: 600"
    )


def _fetch(client: Client, options: argparse.Namespace) -> int:
    with cleaned_up():
        folder = client.fetch(
            options.name, replica=options.replica, into=options.dir, deadline_s=options.timeout
        )
    say([str(folder), *uses(folder)])
    return 0
