"""`palaestra deploy`: drive a real robot with a policy package."""

import argparse
import os

from palaestra.cli.subcommands import Commands, command
from palaestra.local.trainer_program import require_program

PROGRAM = "palaestra-deploy"
DEPLOY = """\
Drives a real Robotino with a package of `palaestra export RUN --to package`. This command passes all its
arguments to the program palaestra-deploy, which the extra palaestra-trainer[deploy] installs on a robot's
computer without PyTorch. `palaestra deploy --help` prints the options of that program.
"""
EXIT_CODES = """\
exit codes:
  0    every episode ended as a success, or only a dry run was asked for
  1    an episode ended without success, or any other error
  2    the package, the robot or an option is wrong, or palaestra-trainer is not installed
  3    a safety rule stopped the robot, or the person did not confirm
  130  ended by Ctrl-C
"""
_NO_PREFIX = "\0"  # no argument begins with it, so argparse takes every argument as a value


def add(commands: Commands) -> None:
    """Add the command."""
    parser = command(commands, "deploy", _deploy, DEPLOY, EXIT_CODES, add_help=False, prefix_chars=_NO_PREFIX)
    parser.add_argument("arguments", nargs="*", metavar="ARGUMENT", help="see palaestra-deploy --help")


def _deploy(options: argparse.Namespace) -> int:
    # The program replaces this process: a stop by Ctrl-Z must reach the process that commands the robot.
    os.execv(require_program(PROGRAM), [PROGRAM, *options.arguments])
