"""`palaestra try`: run a small job in a cluster, or a few episodes of its environment on this machine."""

import argparse
import sys
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

from palaestra.cli.cluster import EXIT_CODES, REFUSED, cleaned_up, cluster_command, say
from palaestra.cli.files import job
from palaestra.cli.subcommands import Commands
from palaestra.client import Client, asked
from palaestra.errors import PalaestraError, SpecErrors
from palaestra.local.trial_episodes import TryOptions, try_here
from palaestra.smoke_test import TrialFailed, attempt
from palaestra_protocol.numbers import seconds, whole

TRY = """\
Creates the TrainingJob in FILE under a unique name, waits until it has ended, and deletes it in any case.
Prints a line for each phase and for each reason why a replica waits. Exits with 1 if the job did not succeed
in time.

With --local, the command uses no cluster and does not train: it plays ten episodes on this machine, in the
environment of FILE and its first collecting simulator. It prints return and length of each episode, the time
of a step by part, and one sentence for each problem with spaces, types, numbers, rewards or ends of episodes.
It exits with 1 if it finds a problem.
"""
LOCAL_EXIT_CODES = """\
  with --local:
  1    problems found, or any other error
  2    the command line, FILE or this machine is not suitable; nothing was started
  80   the simulator had more faults than its restart budget allows
"""
AGENTS = ("zero", "random", "keyboard")
EPISODES = 10


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
    here = parser.add_argument_group("on this machine")
    here.add_argument("--local", action="store_true", help="play episodes here, without a cluster")
    here.add_argument(
        "--agent",
        choices=AGENTS,
        help="source of the actions; keyboard: you drive with arrows and space; default: random",
    )
    here.add_argument("--episodes", metavar="N", type=whole(1), help=f"default: {EPISODES}")
    here.add_argument("--json", action="store_true", help="print one JSON object at the end")
    parser.epilog = EXIT_CODES + LOCAL_EXIT_CODES
    parser.set_defaults(command=_chosen, in_cluster=parser.get_default("command"))


def _chosen(options: argparse.Namespace) -> int:
    """Run the test on this machine or in a cluster."""
    if options.local:
        return _here(options)
    if options.agent is not None or options.episodes is not None or options.json:
        raise PalaestraError(
            "--agent, --episodes, --json: work only with --local; add --local, or remove them"
        )
    work: Callable[[argparse.Namespace], int] = options.in_cluster
    return work(options)


def _here(options: argparse.Namespace) -> int:
    return try_here(
        job(options.file),
        TryOptions(
            agent=options.agent or "random",
            episodes=options.episodes or EPISODES,
            json=options.json,
            version=version("palaestra"),
        ),
    )


def _try(client: Client, options: argparse.Namespace) -> int:
    try:
        tried = job(options.file)
    except SpecErrors as error:  # The job is invalid and no request was sent, so the exit code is 2.
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
