"""`palaestra-webots-ros`: the command line."""

from __future__ import annotations

import argparse
import sys
import sysconfig
from collections.abc import Sequence
from importlib import import_module
from importlib.metadata import version
from pathlib import Path

from palaestra_sim.errors import SimError

_WRONG = 2
_GENERATORS = {"genmsg", "genpy"}  # modules of ROS; Debian's package python3-genpy installs both

_EPILOG = """\
The program writes FOLDER/webots_ros. ROS's tools find the package if FOLDER is /usr/share, or is on
ROS_PACKAGE_PATH. If another webots_ros is importable, or is earlier on ROS_PACKAGE_PATH, ROS uses the other
package.

exit codes: 0; 2 genpy is not installed, the folder cannot be written, or the folder has a webots_ros that
Palaestra did not write
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the package; return the exit code."""
    options = _parser().parse_args(arguments)
    try:
        writer = import_module("palaestra_sim.message_package.package_writer")
        package = writer.write(options.folder)
        if options.importable:
            writer.make_importable(package, Path(sysconfig.get_path("purelib")))
    except ModuleNotFoundError as error:
        if error.name not in _GENERATORS:
            raise
        remedy = "install python3-genpy, and use the Python of the distribution"
        sys.stderr.write(f"palaestra-webots-ros: {error.name} of ROS is not installed; {remedy}\n")
    except SimError as error:
        sys.stderr.write(f"palaestra-webots-ros: {error}\n")
    except OSError as error:
        place = error.filename or options.folder
        sys.stderr.write(f"palaestra-webots-ros: {place}: {error.strerror}; choose a folder to write to\n")
    else:
        return 0
    return _WRONG


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="palaestra-webots-ros",
        description="Write the ROS package webots_ros, the messages and services of a simulator.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("--version", action="version", version=version("palaestra-sim"))
    add("folder", type=Path, help="the folder for the package, such as /usr/share")
    add("--importable", action="store_true", help="also make it importable for the Python that runs this")
    return parser
