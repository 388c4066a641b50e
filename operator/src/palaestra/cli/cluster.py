"""What the commands about a cluster's jobs have in common: which cluster, and how they end."""

import argparse
import os
import signal
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager

from palaestra.cli.parsing import CONTEXT, KUBECONFIG, NAMESPACE, Commands, command
from palaestra.client import Client, ClientError
from palaestra.cluster import ApiError, Forbidden
from palaestra.errors import SpecErrors

REFUSED = 1

EXIT_CODES = """\
exit codes:
  0    done
  1    the cluster has no such job, refuses, or did not come to it in time; the line says why
  2    the command line or the kubeconfig is not as it must be; nothing was asked
  130  ended by Ctrl-C
"""

Work = Callable[[Client, argparse.Namespace], int]


def cluster_command(
    commands: Commands, name: str, work: Work, summary: str, description: str
) -> argparse.ArgumentParser:
    """Return the parser of a new command on a cluster, with kubectl's options for which one."""
    parser = command(commands, name, _connected(work), summary, description, EXIT_CODES)
    parser.add_argument(*NAMESPACE, metavar="NS", help="of the jobs; default: the context's")
    parser.add_argument(CONTEXT, metavar="NAME", help="of the kubeconfig; default: its current one")
    parser.add_argument(KUBECONFIG, metavar="FILE", help="default: $KUBECONFIG, then ~/.kube/config")
    return parser


def say(lines: Iterable[str]) -> None:
    """Write lines to standard output, each as soon as it is there."""
    for line in lines:
        sys.stdout.write(f"{line}\n")
        sys.stdout.flush()


@contextmanager
def cleaned_up() -> Iterator[None]:
    """Let SIGTERM end what is done here as Ctrl-C does, so that what was made meanwhile is deleted then, too.

    The first process of a container would ignore it otherwise.
    """
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _connected(work: Work) -> Callable[[argparse.Namespace], int]:
    """Return the command: it connects, works, and tells in a line what the cluster did not do."""

    def run(options: argparse.Namespace) -> int:
        client = Client(namespace=options.namespace, kubeconfig=options.kubeconfig, context=options.context)
        with client:
            try:
                return work(client, options)
            except Forbidden as error:
                hint = "; `palaestra doctor` tells which rights are missing" if error.lacks_right else ""
                return _refused(f"{error}{hint}")
            except (ApiError, ClientError, SpecErrors) as error:
                return _refused(str(error))
            except BrokenPipeError:  # who read the output has seen enough, as `| head`
                os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
                return 0

    return run


def _refused(line: str) -> int:
    sys.stderr.write(f"{line}\n")
    return REFUSED
