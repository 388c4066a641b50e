"""Commands in this machine's file system without the packages of ROS, in a mount namespace of their own.

An overlay lies over /usr, so nothing is changed outside the namespace. In it, everything of Debian's packages
of ROS is deleted. That is more than an import hook could hide: programs, libraries and definitions too.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Sequence
from functools import cache
from pathlib import Path

# Of Debian's source packages. netifaces and defusedxml are there for ROS alone.
_SOURCES = ("ros-", "netifaces", "defusedxml")
_SCRIPT = """\
set -e
top=$1; list=$2; how=$3; shift 3
mount -t tmpfs overlay "$top"
mkdir "$top/upper" "$top/work"
mount -t overlay overlay -o "${how}lowerdir=/usr,upperdir=$top/upper,workdir=$top/work" /usr
xargs --arg-file="$list" --delimiter='\\n' rm -rf
if [ -d /opt/ros ]; then mount -t tmpfs empty /opt/ros; fi
exec "$@"
"""


def works(folder: Path) -> bool:
    """Return whether this machine lets us make such a file system, in an empty folder."""
    if not all(map(shutil.which, ("unshare", "dpkg-query"))):
        return False
    done = subprocess.run(command(["true"], folder), capture_output=True, timeout=60, check=False)
    return done.returncode == 0


def command(words: Sequence[str | Path], folder: Path) -> list[str]:
    """Return a command that runs another one without ROS.

    Args:
        words: of the other command.
        folder: a folder outside of /usr for the overlay; what is written there lives as long as the command.
    """
    top = folder / "overlay"
    top.mkdir(exist_ok=True)
    paths = folder / "ros.txt"
    paths.write_text("\n".join(_paths()))
    is_root = os.geteuid() == 0
    namespace = ("unshare", "--mount", *(() if is_root else ("--map-root-user",)), "--")
    how = "" if is_root else "userxattr,"  # the attributes in which an overlay notes what is deleted
    return [*namespace, "sh", "-c", _SCRIPT, "sh", str(top), str(paths), how, *map(str, words)]


@cache
def _paths() -> list[str]:
    """Return the files of the packages, and the folders that only they have."""
    form = "${binary:Package} ${source:Package}\n"
    listed = subprocess.run(
        ["dpkg-query", "--show", "--showformat", form], capture_output=True, text=True, check=True
    ).stdout
    sources = dict(line.split() for line in listed.splitlines())
    packages = [name for name, source in sources.items() if source.startswith(_SOURCES)]
    others = [name for name in sources if name not in packages]
    held = {path for path in _held(packages) if path.startswith("/usr/")}
    return sorted(held - {*_held(others)})


def _held(packages: list[str]) -> list[str]:
    """Return the paths in packages."""
    if not packages:
        return []
    words = ["dpkg", "--listfiles", *packages]
    return subprocess.run(words, capture_output=True, text=True, check=True).stdout.splitlines()
