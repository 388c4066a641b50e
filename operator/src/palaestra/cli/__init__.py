"""The command line of `palaestra`: parses arguments, prints text and returns an exit code."""

import argparse
import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from types import ModuleType

from palaestra.api.text import printable
from palaestra.cli.commands import COMMANDS
from palaestra.cli.subcommands import ALL_EXIT_CODES, CONTEXT, KUBECONFIG, NAMESPACE, WRONG_INPUT
from palaestra.errors import PalaestraError
from palaestra.local.errors import KILLED, LocalError
from palaestra.standard_output import drop_output, flush_output, output_fails
from palaestra_protocol.imports import import_without, without_collections
from palaestra_protocol.linux import require_linux
from palaestra_sim.errors import SimError

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    If the reader of the output ends early, as `| head` does, the command drops the remaining lines.
    """
    code = 0
    try:
        try:
            code = _run(arguments)
        finally:
            flush_output()
    except OSError as error:
        if not output_fails():
            raise
        drop_output()
        if not isinstance(error, BrokenPipeError):
            fact = f"standard output: {error.strerror}"
            return _failed(f"{fact}; free some space, or write to another disk", LocalError.exit_code)
    return code


def _run(arguments: Sequence[str] | None) -> int:
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
        return _failed(str(error), error.exit_code)
    except (PalaestraError, SimError) as error:
        return _failed(str(error), WRONG_INPUT)
    except KeyboardInterrupt:  # Ctrl-C before a run was started
        return KILLED


def _module(name: str, module: str) -> ModuleType:
    """Return the module of a command.

    Raises:
        SystemExit: the command needs modules that Python on this system lacks.
    """
    try:
        return import_module(f"palaestra.cli.{module}")
    except ImportError:
        require_linux(f"{_typed()} {name}")
        raise


def _failed(text: str, exit_code: int) -> int:
    sys.stderr.write(f"{printable(text)}\n")
    return exit_code


def _of_a_cluster(argument: str) -> bool:
    """Return whether an argument is one of kubectl's options, which only cluster commands accept."""
    return argument.partition("=")[0] in {*NAMESPACE, CONTEXT, KUBECONFIG}


def _typed() -> str:
    """Return the program's name for usage texts: `palaestra`, or `kubectl palaestra` as a plugin."""
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
    named = COMMANDS.get(first[0]) if first else None
    if named is None:
        for name, each in COMMANDS.items():
            commands.add_parser(name, help=each.summary)
    else:
        with without_collections():
            import_without("rich", "structlog")  # with rich, structlog would format tracebacks
            _module(first[0], named.module).add(commands)
    return parser
