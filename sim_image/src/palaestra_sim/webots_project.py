"""A Webots project that contains only the controller `ros`.

Webots searches a controller first in the project of the world, then in the folders of
WEBOTS_EXTRA_PROJECT_PATH, and last in its own projects. So this project replaces the controller `ros` of
R2023b, and provides it in later releases, which lack it. A project with a controller `ros` of its own keeps
that controller. Source: WbRobot.cpp::updateControllerDir, WbProject.cpp::extraProjects of Webots.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from palaestra_protocol.whole_file import write_whole

EXTRA_PROJECTS: Final = "WEBOTS_EXTRA_PROJECT_PATH"
"""The environment variable of Webots with a list of project folders, in the format of PATH."""

# Webots reads the first line itself, and starts the controller with this interpreter.
_IMPORT: Final = "from palaestra_sim.webots.cli import run"
_CONTROLLER: Final = f"""\
#!{{interpreter}}
\"\"\"The controller `ros` of Palaestra; palaestra writes this file, so changes are lost.\"\"\"

{_IMPORT}

run()
"""


def extra_projects(folder: Path, environment: Mapping[str, str]) -> dict[str, str]:
    """Return the environment variable that makes Webots search `folder` before all other extra projects."""
    others = environment.get(EXTRA_PROJECTS, "")
    return {EXTRA_PROJECTS: f"{folder}{os.pathsep}{others}" if others else str(folder)}


def foreign_controller(folder: Path) -> Path | None:
    """Return a file of another controller `ros` in the project; None if only ours is there."""
    for path in sorted(_controller(folder).parent.glob("*")):
        ours = path.name == "__pycache__" or (path.name == "ros.py" and _IMPORT in path.read_text())
        if not ours:
            return path
    return None


def write_project(folder: Path, interpreter: str = sys.executable) -> Path:
    """Write the project into a folder, and return the path of the controller.

    Args:
        folder: the folder of the project; it is created if it does not exist.
        interpreter: the full path of a Python that has this package.

    Raises:
        OSError: the file cannot be written; no partial file is left.
    """
    controller = _controller(folder)
    controller.parent.mkdir(parents=True, exist_ok=True)
    write_whole(controller, _CONTROLLER.format(interpreter=interpreter).encode())
    return controller


def _controller(folder: Path) -> Path:
    return folder / "controllers" / "ros" / "ros.py"
