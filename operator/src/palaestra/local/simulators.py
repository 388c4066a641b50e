"""The simulators of this machine: the program of each driver, and a check whether this program is installed.

This package does not import simulators, so it only checks that their programs and libraries exist.
"""

import importlib.util
import shutil
from collections.abc import Mapping

from palaestra.api import Driver
from palaestra.local.process import program_path

PROGRAMS: Mapping[Driver, str] = {
    Driver.STUB: "palaestra-stub",
    Driver.MUJOCO: "palaestra-mujoco",
    Driver.WEBOTS: "webots",
}
# palaestra-mujoco is installed together with the stub, but its library, MuJoCo, is an extra.
_LIBRARIES = {"palaestra-mujoco": "mujoco"}
_EXTRA = "install palaestra-sim[mujoco] (`make setup` does)"


def lack(program: str) -> str | None:
    """Return the reason for which a program cannot start on this machine, with the remedy, or None."""
    library = _LIBRARIES.get(program)
    if shutil.which(program, path=program_path()) is None:
        return f"{program} is not a program on this machine; {'install it' if library is None else _EXTRA}"
    if library is not None and importlib.util.find_spec(library) is None:
        return f"{program} needs the Python package {library}, which is not installed; {_EXTRA}"
    return None
