"""The program that Webots starts for each robot; `webots_project` writes the file that calls it."""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Sequence
from typing import Final

from palaestra_sim import faults
from palaestra_sim.errors import SimError
from palaestra_sim.webots.library import Library, LibraryError, load
from palaestra_sim.webots.options import read_options
from palaestra_sim.webots.process import ControllerProcess

log = logging.getLogger(__name__)

_WRONG: Final = 2
_OF_A_SIDECAR: Final = "PALAESTRA_SIMULATOR_SLOT"  # every sidecar sets this variable


def main(arguments: Sequence[str] | None = None) -> int:
    """Serve the robot of this process.

    Return the exit code: 2 if an option, a fault or libController is wrong. After a wrong option or fault, a
    supervisor in the Webots of a sidecar also ends Webots with this code, because the robot would never move.
    """
    given = sys.argv[1:] if arguments is None else arguments
    logging.basicConfig(level=logging.INFO, format="ros: %(message)s", stream=sys.stderr)
    try:
        library = load()
    except LibraryError as error:
        sys.stderr.write(f"ros: {error}\n")
        return _WRONG
    library.robot_init()
    try:
        return _serve(library, given)
    except SimError as error:
        sys.stderr.write(f"ros: {error}\n")
        if _OF_A_SIDECAR in os.environ and library.robot_get_supervisor():
            library.supervisor_simulation_quit(_WRONG)
        return _WRONG


def _serve(library: Library, arguments: Sequence[str]) -> int:
    options = read_options(arguments)
    ordered = faults.read_environment(os.environ)
    for argument in options.unknown:
        log.warning("controllerArgs has %s, which has no effect", argument)
    return ControllerProcess(library, options, ordered).run()


def run() -> None:
    """Call `main`, and end the process at once, because a pending step would hold libController's lock."""
    code = main()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)
