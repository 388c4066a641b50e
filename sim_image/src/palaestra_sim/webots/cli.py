"""The program that Webots starts for each robot; `project` writes the file that calls it."""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Sequence
from typing import Final

from palaestra_sim.errors import SimError
from palaestra_sim.webots.library import load
from palaestra_sim.webots.options import read_options
from palaestra_sim.webots.process import ControllerProcess

log = logging.getLogger(__name__)

_WRONG: Final = 2


def main(arguments: Sequence[str] | None = None) -> int:
    """Serve the robot of this process; return the exit code: 2 if options or libController are wrong."""
    given = sys.argv[1:] if arguments is None else arguments
    logging.basicConfig(level=logging.INFO, format="ros: %(message)s", stream=sys.stderr)
    try:
        options = read_options(given)
        library = load()
    except SimError as error:
        sys.stderr.write(f"ros: {error}\n")
        return _WRONG
    for argument in options.unknown:
        log.warning("controllerArgs has %s, which has no effect", argument)
    return ControllerProcess(library, options).run()


def run() -> None:
    """Call `main`, and end the process at once, because a pending step would hold libController's lock."""
    code = main()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)
