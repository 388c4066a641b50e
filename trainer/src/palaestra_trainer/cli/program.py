"""Functions for all programs of this package: their help, their messages and their exit codes."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable

import structlog

from palaestra_protocol.pod.status import ExitCode, Termination
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.run.exit import leave_after
from palaestra_trainer.run.signals import Interrupted
from palaestra_trainer.run.telemetry.logs import last_lines
from palaestra_trainer.run.termination import UNEXPECTED, end_of, write_last_word

log = structlog.get_logger(__name__)

LEFT_S = 10.0  # time for the work of libraries at the exit of Python, such as an upload
KEYBOARD_INTERRUPT = 130  # the exit status that shells report for a process that SIGINT ended
_EXTRAS = {
    **dict.fromkeys(("PIL", "sb3_contrib", "stable_baselines3", "tensorboard", "torch"), "train"),
    **dict.fromkeys(("httpx", "mcap", "mcap_ros2", "onnxruntime"), "deploy"),
}
_KEPT = (ExitCode.CONFIGURATION, ExitCode.FAULT_BUDGET)


def parser(name: str, description: str, exit_codes: str) -> argparse.ArgumentParser:
    """Return the parser of a program; its help ends with the exit codes."""
    return argparse.ArgumentParser(
        prog=name,
        description=description,
        epilog=exit_codes,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )


def refuse(error: BaseException) -> int:
    """Log each line of an error, write the error as the termination message, and return its exit code."""
    end = end_of(error)
    for line in end.message.splitlines():
        log.error(line, reason=end.reason)
    write_last_word(Termination(step=0, reason=f"{end.reason}: {end.message}", log=last_lines()))
    return int(end.code)


def refuse_without_run(error: BaseException) -> int:
    """Log the error of a program that cannot be resumed, and return its exit code."""
    if isinstance(error, KeyboardInterrupt | Interrupted):
        log.error("ended by Ctrl-C")
        return KEYBOARD_INTERRUPT
    code = refuse(error)
    return code if code in _KEPT else UNEXPECTED


def write_line(line: str) -> None:
    """Write a line to standard output at once, even if the output is a pipe."""
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def leaving(program: Callable[[], int]) -> int:
    """Run a program and return its exit code; the process ends soon even if a thread of the job still runs.

    The libraries of an extra may be missing, because a robot's computer does not need PyTorch, and a trainer
    does not need the libraries for robots. The logged error then names the extra.
    """
    try:
        code = program()
    except ModuleNotFoundError as error:
        if (extra := _EXTRAS.get(error.name or "")) is None:
            raise
        fact = f"{error.name} is not installed; install palaestra-trainer[{extra}]"
        code = refuse_without_run(ConfigurationError(fact))
    sys.stdout.flush()
    leave_after(LEFT_S, code)
    return code
