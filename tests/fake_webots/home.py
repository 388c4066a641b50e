"""WEBOTS_HOME of a release, with the library of the tests, and the command `webots`."""

import subprocess
import sys
from pathlib import Path

from tests.fake_webots.wire import FOLDER

RELEASES = ("R2023b", "R2025a")
REPOSITORY = FOLDER.parents[1]
_STOCK = '#!/bin/sh\necho "the controller of Webots was started"\nexec sleep 1000\n'


def make_home(folder, release="R2025a", python=sys.executable, repository=REPOSITORY):
    """Write a WEBOTS_HOME into a folder, and return its path.

    The home of R2023b also contains Webots' own controller `ros`, a program; R2025a has removed it.

    Args:
        folder: the folder in which the home is made.
        release: the release of Webots, which is also the name of the home.
        python: the Python that runs the command `webots`.
        repository: the folder that has the package `tests`, where the command runs.
    """
    home = Path(folder) / release
    library = home / "lib" / "controller" / "libController.so"
    library.parent.mkdir(parents=True)
    old = [] if release == "R2025a" else [f"-D{release}"]
    source = FOLDER / "libcontroller.c"
    subprocess.run(
        ["gcc", "-O1", "-Wall", "-Werror", *old, "-shared", "-fPIC", "-o", library, source, "-lpthread"],
        check=True,
    )
    version = home / "resources" / "version.txt"
    version.parent.mkdir()
    version.write_text(f"{release}\n")
    if release == "R2023b":
        stock = home / "projects" / "default" / "controllers" / "ros" / "ros"
        stock.parent.mkdir(parents=True)
        _write_program(stock, _STOCK)
    command = f'PYTHONPATH={repository} exec {python} -m tests.fake_webots.program "$@"'
    _write_program(home / "webots", f"#!/bin/sh\n{command}\n")
    return home


def _write_program(path, text):
    path.write_text(text)
    path.chmod(0o755)
