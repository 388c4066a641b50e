"""The command lines of the simulators: the stub, MuJoCo, Webots, and other programs."""

import os
import shutil
import sys
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from palaestra_sim.errors import SidecarError
from palaestra_sim.sidecar.process import CommandLine

WORLD = "{world}"  # represents the path of the world in the arguments of a program
_NOT_ROOT = "palaestra"
_MESA_THREADS = "LP_NUM_THREADS"

_FIRST_PORT, _PORTS = 10_000, 20_000  # below the ports that Linux assigns to clients

# Source: Webots' guide, "Command Line Arguments". --batch prevents dialogs that wait for a click.
# With --minimize but without --mode, Webots would start in fast mode.
_WEBOTS = ("--batch", "--mode=pause", "--stdout", "--stderr")
# --no-rendering turns off only the main 3D view: Webots renders cameras in each step, even without this view
# (WbSimulationWorld::step). Movies, the stream mjpeg and, in R2023b, exported images show the main 3D view.
# Webots' simulation_server.py leaves out both options for the stream mjpeg.
_WITHOUT_VIEW = ("--minimize", "--no-rendering")
_SHOWS_VIEW = "--stream=mjpeg"


class Driver(StrEnum):
    """The kinds of simulator programs."""

    STUB = "stub"
    MUJOCO = "mujoco"
    WEBOTS = "webots"
    COMMAND = "command"


SHOWN = (Driver.STUB, Driver.MUJOCO)  # these simulators describe their world to viewers


@dataclass(frozen=True, slots=True, kw_only=True)
class Launch:
    """The inputs of a start.

    Attributes:
        world: the path of the world.
        root: the folder that holds all files of the world; None if the simulator has to find it.
        options: additional options for the simulator.
        program: for the driver `command`, the program and its arguments.
    """

    world: Path
    root: Path | None = None
    options: Sequence[str] = ()
    program: Sequence[str] = ()


def command(driver: Driver, launch: Launch, environment: Mapping[str, str]) -> CommandLine:
    """Return the command line that starts the simulator, with the full path of its program.

    Raises:
        SidecarError: the program does not exist, or the driver `command` has no program.
    """
    arguments = _ARGUMENTS[driver](launch)
    own = {**environment, **_ENVIRONMENT[driver](environment)}
    return CommandLine(arguments=(_found(driver, arguments[0], environment), *arguments[1:]), environment=own)


def webots_port(name: str) -> int:
    """Return the TCP port of the Webots whose world has this name; different names seldom share a port."""
    return _FIRST_PORT + zlib.crc32(name.encode()) % _PORTS


def _stub(launch: Launch) -> list[str]:
    return ["palaestra-stub", str(launch.world), *launch.options]


def _mujoco(launch: Launch) -> list[str]:
    root = [] if launch.root is None else [f"--root={launch.root}"]
    return ["palaestra-mujoco", str(launch.world), *root, *launch.options]


def _webots(launch: Launch) -> list[str]:
    view = () if _SHOWS_VIEW in launch.options else _WITHOUT_VIEW
    return ["webots", *_WEBOTS, *view, str(launch.world), *launch.options]


def _command(launch: Launch) -> list[str]:
    if not launch.program:
        raise SidecarError("--driver command: has no program; add it after --, as in -- sim {world}")
    given = (argument.replace(WORLD, str(launch.world)) for argument in launch.program)
    return [*given, *launch.options]


def _nothing(environment: Mapping[str, str]) -> dict[str, str]:
    """Return no variables: the program inherits the container's environment unchanged."""
    del environment
    return {}


def _for_mujoco(environment: Mapping[str, str]) -> dict[str, str]:
    """Return a variable that makes Mesa render in the simulator's own thread.

    More threads would take cores from other simulators. MUJOCO_GL stays unset: if it is set, `import mujoco`
    loads OpenGL, and fails on a machine without OpenGL.
    """
    return {_MESA_THREADS: environment.get(_MESA_THREADS, "0")}


def _for_webots(environment: Mapping[str, str]) -> dict[str, str]:
    """Return the environment variables for Webots.

    Webots needs USER, which containers often lack. With the other variable, Webots writes no files next to
    the world.
    """
    return {
        "USER": environment.get("USER", _NOT_ROOT),
        "WEBOTS_DISABLE_SAVE_SCREEN_PERSPECTIVE_ON_CLOSE": "true",
    }


def _found(driver: Driver, program: str, environment: Mapping[str, str]) -> str:
    """Return the full path of a program: on the PATH, or in the folder of the running Python."""
    python_folder = os.fspath(Path(sys.executable).parent)
    for path in (environment.get("PATH", os.defpath), python_folder):
        if (found := shutil.which(program, path=path)) is not None:
            return str(Path(found).absolute())
    raise SidecarError(f"--driver {driver}: the program {program} was not found; install it, or set PATH")


_ARGUMENTS: Mapping[Driver, Callable[[Launch], list[str]]] = {
    Driver.STUB: _stub,
    Driver.MUJOCO: _mujoco,
    Driver.WEBOTS: _webots,
    Driver.COMMAND: _command,
}
_ENVIRONMENT: Mapping[Driver, Callable[[Mapping[str, str]], dict[str, str]]] = {
    Driver.STUB: _nothing,
    Driver.MUJOCO: _for_mujoco,
    Driver.WEBOTS: _for_webots,
    Driver.COMMAND: _nothing,
}
