"""The declaration of a command in argparse, and the exit codes that all commands share."""

import argparse
from collections.abc import Callable
from typing import Any, Protocol

from palaestra.cli.commands import COMMANDS

WRONG_INPUT = 2
NAMESPACE = ("-n", "--namespace")
CONTEXT, KUBECONFIG = "--context", "--kubeconfig"

EXIT_CODES = """\
exit codes:
  0    done
  1    failed; the last lines of the log give the reason
  2    the job, a world or this machine is not suitable; nothing was started
  75   interrupted after a checkpoint; run the same command to resume
  80   a simulator had more faults than its restart budget allows
  81   training diverged
  82   training stalled
  130  killed by a second Ctrl-C; run the same command to resume from the newest checkpoint
"""
ALL_EXIT_CODES = """\
exit codes of all commands:
  0    done
  1    failed, or the cluster has no such job, refused, or the deadline passed; the last lines give the reason
  2    the command line, a file, the kubeconfig or this machine is not suitable; nothing was started
  3    of `compare` only: undecided
  75   of `run` and `sweep`: interrupted after a checkpoint
  80   of `run`, `compare` and `try --local`
  81, 82  of `run` only
  130  ended by Ctrl-C
`COMMAND --help` explains the exit codes of one command.
"""


class Commands(Protocol):
    """The object that adds commands to a parser; a protocol, because argparse's own class is not public."""

    def add_parser(self, *args: Any, **options: Any) -> argparse.ArgumentParser:
        """Return the parser of a new command."""
        ...


def command(
    commands: Commands,
    name: str,
    function: Callable[[argparse.Namespace], int],
    description: str,
    exit_codes: str = EXIT_CODES,
    **options: Any,
) -> argparse.ArgumentParser:
    """Return the parser of a new command; `function` runs the command and returns its exit code.

    `options` are further arguments of argparse's parser.
    """
    parser = commands.add_parser(
        name,
        help=COMMANDS[name].summary,
        description=description,
        epilog=exit_codes,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        **options,
    )
    parser.set_defaults(command=function)
    return parser
