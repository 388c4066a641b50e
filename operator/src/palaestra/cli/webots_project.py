"""`palaestra webots-project`: the controller `ros` for Webots on a desktop."""

import argparse
import sys
from pathlib import Path

from palaestra.cli.subcommands import Commands, command
from palaestra.errors import PalaestraError
from palaestra_sim.webots_project import EXTRA_PROJECTS, foreign_controller, write_project

WEBOTS_PROJECT = """\
Writes a Webots project with the controller `ros` of Palaestra into the folder DIR, and prints the environment
variable that makes Webots find the project. Webots then starts this controller for each robot whose field
`controller` is "ros". The controller works with Webots R2023b and later; later releases have no `ros`
controller of their own.
"""
EXIT_CODES = """\
exit codes:
  0    done
  2    DIR has another controller `ros`, or cannot be written
"""


def add(commands: Commands) -> None:
    """Add the command."""
    parser = command(commands, "webots-project", _webots_project, WEBOTS_PROJECT, EXIT_CODES)
    parser.add_argument("dir", metavar="DIR", type=Path, help="folder of the project; it may be new")


def _webots_project(options: argparse.Namespace) -> int:
    folder: Path = options.dir.absolute()
    foreign = foreign_controller(folder)
    if foreign is not None:
        raise PalaestraError(f"{foreign} belongs to another controller `ros`; give another folder as DIR")
    try:
        write_project(folder)
    except OSError as error:
        raise PalaestraError(
            f"{error.filename or folder}: {error.strerror}; give a folder in which you can write"
        ) from error
    sys.stdout.write(f"export {EXTRA_PROJECTS}={folder}\n")
    return 0
