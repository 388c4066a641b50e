"""The command line of `palaestra`: parses arguments, prints text and returns an exit code."""

import argparse
import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from importlib.metadata import version
from pathlib import Path

from palaestra.cli.parsing import ALL_EXIT_CODES, CONTEXT, KUBECONFIG, NAMESPACE, WRONG_INPUT
from palaestra.errors import PalaestraError
from palaestra.local.errors import KILLED, LocalError
from palaestra_sim.errors import SimError

__all__ = ["main"]

# Modules with commands, in the order of the help. The operator runs for months and imports only its own.
COMMANDS = (
    "run", "sweep", "exporting", "documents", "operator", "looking", "watching", "changing", "fetching",
    "doctor", "trial",
)  # fmt: skip
OPERATOR = ["operator"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    typed = sys.argv[1:] if arguments is None else arguments
    parser = _parser(typed[:1])
    if typed and _of_a_cluster(typed[0]):
        option = typed[0].partition("=")[0]
        parser.error(f"{option}: must come after the command, as in `{_typed()} get {option} ...`")
    options = parser.parse_args(typed)
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


def _of_a_cluster(argument: str) -> bool:
    """Return whether an argument is one of kubectl's options, which only cluster commands accept."""
    return argument.partition("=")[0] in {*NAMESPACE, CONTEXT, KUBECONFIG}


def _typed() -> str:
    """Return the name to show in usage: `palaestra`, or `kubectl palaestra` when run as a kubectl plugin."""
    return "kubectl palaestra" if Path(sys.argv[0]).name == "kubectl-palaestra" else "palaestra"


def _parser(first: Sequence[str]) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog=_typed(),
        description="Train robots in simulators, from a TrainingJob.",
        epilog=ALL_EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"palaestra {version('palaestra')}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    if first == OPERATOR:
        _leave_out("rich", "structlog")
    for name in OPERATOR if first == OPERATOR else COMMANDS:
        import_module(f"palaestra.cli.{name}").add(commands)
    return parser


def _leave_out(part: str, module: str) -> None:
    """Import a module as if its optional dependency `part` were not installed.

    structlog imports rich (4 MiB with its own imports) only to format tracebacks on terminals.
    """
    if part not in sys.modules and module not in sys.modules:
        sys.modules[part] = None  # type: ignore[assignment]  # so Python documents how to forbid an import
        import_module(module)
        del sys.modules[part]
