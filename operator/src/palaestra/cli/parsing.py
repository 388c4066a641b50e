"""What all commands have in common: how they are declared, and how they end."""

import argparse
from collections.abc import Callable
from typing import Any, Protocol

WRONG_INPUT = 2
NAMESPACE = ("-n", "--namespace")
CONTEXT, KUBECONFIG = "--context", "--kubeconfig"

EXIT_CODES = """\
exit codes:
  0    done
  1    failed; the last lines of the log say why
  2    the job, a world or this machine is not as it must be; nothing was started
  75   interrupted and checkpointed; the same command goes on
  80   a simulator's budget for faults is spent
  81   training diverged
  82   training stalled
  130  killed by a second Ctrl-C; the same command goes on from the newest checkpoint
"""
ALL_EXIT_CODES = """\
exit codes of all commands:
  0    done
  1    failed, or the cluster has no such job, refuses, or did not come to it in time; the last lines say why
  2    the command line, a file, the kubeconfig or this machine is not as it must be; nothing was started
  75, 80, 81, 82  of `run` alone
  130  ended by Ctrl-C
`COMMAND --help` explains those of one command.
"""


class Commands(Protocol):
    """What argparse gives for adding commands; its own class has no public name."""

    def add_parser(self, *args: Any, **options: Any) -> argparse.ArgumentParser:
        """Return the parser of a new command."""
        ...


def command(
    commands: Commands,
    name: str,
    function: Callable[[argparse.Namespace], int],
    summary: str,
    description: str,
    exit_codes: str = EXIT_CODES,
) -> argparse.ArgumentParser:
    """Return the parser of a new command, which `function` carries out and returns its exit code."""
    parser = commands.add_parser(
        name,
        help=summary,
        description=description,
        epilog=exit_codes,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(command=function)
    return parser
