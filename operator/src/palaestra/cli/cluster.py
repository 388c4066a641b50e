"""The common options and exit codes of the commands for a cluster."""

import argparse
import signal
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager

from palaestra.api.text import printable
from palaestra.cli.subcommands import CONTEXT, KUBECONFIG, NAMESPACE, Commands, command
from palaestra.client import Client, ClientError
from palaestra.cluster import ApiError, Forbidden
from palaestra.errors import SpecErrors

REFUSED = 1

EXIT_CODES = """\
exit codes:
  0    done
  1    the cluster has no such job, refused, or the deadline passed; the line gives the reason
  2    the command line or the kubeconfig is wrong; nothing was sent to the cluster
  130  ended by Ctrl-C
"""

Work = Callable[[Client, argparse.Namespace], int]


def cluster_command(commands: Commands, name: str, work: Work, description: str) -> argparse.ArgumentParser:
    """Return the parser of a new command for a cluster, with kubectl's options that choose the cluster."""
    parser = command(commands, name, connected(work), description, EXIT_CODES)
    add_cluster(parser)
    return parser


def add_cluster(parser: argparse.ArgumentParser) -> None:
    """Add kubectl's options that choose the cluster."""
    parser.add_argument(*NAMESPACE, metavar="NS", help="namespace of the jobs; default: the context's")
    parser.add_argument(CONTEXT, metavar="NAME", help="kubeconfig context; default: the current one")
    parser.add_argument(
        KUBECONFIG, metavar="FILE", help="kubeconfig; default: $KUBECONFIG, then ~/.kube/config"
    )


def say(lines: Iterable[str]) -> None:
    """Write each line to standard output and flush it. Omit control characters, which a pod may have sent."""
    for line in lines:
        sys.stdout.write(f"{printable(line)}\n")
        sys.stdout.flush()


@contextmanager
def cleaned_up() -> Iterator[None]:
    """Handle SIGTERM like Ctrl-C, so that temporary objects are deleted.

    Without a handler, process 1 of a container would ignore SIGTERM.
    """
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def connected(work: Work) -> Callable[[argparse.Namespace], int]:
    """Return a command that connects, runs `work`, and prints an error of the cluster as one line."""

    def run(options: argparse.Namespace) -> int:
        client = Client(namespace=options.namespace, kubeconfig=options.kubeconfig, context=options.context)
        with client:
            try:
                return work(client, options)
            except Forbidden as error:
                hint = "; `palaestra doctor` lists the missing rights" if error.lacks_right else ""
                return _refused(f"{error}{hint}")
            except (ApiError, ClientError, SpecErrors) as error:
                return _refused(str(error))

    return run


def _refused(line: str) -> int:
    sys.stderr.write(f"{printable(line)}\n")
    return REFUSED
