"""The simulators of this machine: the program that each driver starts, and whether it is installed.

The operator's package imports no simulator, so a library of one is only looked for.
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
# Its program is installed with the stub's, its library is an extra.
_LIBRARIES = {"palaestra-mujoco": "mujoco"}
_EXTRA = "install palaestra-sim[mujoco] (`make setup` does)"


def lack(program: str) -> str | None:
    """Return why a program cannot be started on this machine, with the remedy; None if it can."""
    library = _LIBRARIES.get(program)
    if shutil.which(program, path=program_path()) is None:
        return f"{program} is not a program on this machine; {'install it' if library is None else _EXTRA}"
    if library is not None and importlib.util.find_spec(library) is None:
        return f"{program} needs the Python package {library}, which is not installed; {_EXTRA}"
    return None
