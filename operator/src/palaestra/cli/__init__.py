"""The command line of `palaestra`: arguments in, text and an exit code out; the work is elsewhere."""

import argparse
import sys
from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path

from palaestra.cli import changing, doctor, documents, fetching, looking, operator, run, trial, watching
from palaestra.cli.parsing import EXIT_CODES, WRONG_INPUT
from palaestra.errors import PalaestraError
from palaestra.local.errors import LocalError
from palaestra.local.replica import KILLED
from palaestra_sim.errors import SimError

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    options = _parser().parse_args(arguments)
    command: Callable[[argparse.Namespace], int] = options.command
    try:
        return command(options)
    except LocalError as error:
        return _failed(error, error.exit_code)
    except (PalaestraError, SimError) as error:
        return _failed(error, WRONG_INPUT)
    except KeyboardInterrupt:  # before anything was started
        return KILLED


def _failed(error: Exception, exit_code: int) -> int:
    sys.stderr.write(f"{error}\n")
    return exit_code


def _typed() -> str:
    """Return how the command line is called: by itself, or by kubectl, which finds a plugin by its name."""
    return "kubectl palaestra" if Path(sys.argv[0]).name == "kubectl-palaestra" else "palaestra"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog=_typed(),
        description="Train robots in simulators, from a TrainingJob.",
        epilog=EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"palaestra {version('palaestra')}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    run.add(commands)
    documents.add(commands)
    operator.add(commands)
    looking.add(commands)
    watching.add(commands)
    changing.add(commands)
    fetching.add(commands)
    doctor.add(commands)
    trial.add(commands)
    return parser
