"""Run commands in a mount namespace without Debian's packages of ROS.

An overlay over /usr hides all files of these packages; nothing changes outside the namespace. Unlike an
import hook, the overlay also hides programs, libraries and message definitions.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Sequence
from functools import cache
from pathlib import Path

# Prefixes of the names of Debian's source packages. Only ROS needs netifaces and defusedxml.
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
    """Return whether this machine permits such a namespace; `folder` is an empty folder for the trial."""
    if not all(map(shutil.which, ("unshare", "dpkg-query"))):
        return False
    done = subprocess.run(command(["true"], folder), capture_output=True, timeout=60, check=False)
    return done.returncode == 0


def command(words: Sequence[str | Path], folder: Path) -> list[str]:
    """Return a command that runs `words` without ROS.

    Args:
        words: the program and its arguments.
        folder: a folder outside of /usr for the overlay; files that the command writes to /usr end with
            it.
    """
    top = folder / "overlay"
    top.mkdir(exist_ok=True)
    paths = folder / "ros.txt"
    paths.write_text("\n".join(_paths()))
    is_root = os.geteuid() == 0
    namespace = ("unshare", "--mount", *(() if is_root else ("--map-root-user",)), "--")
    how = "" if is_root else "userxattr,"  # an unprivileged overlay marks deleted files in `user.` attributes
    return [*namespace, "sh", "-c", _SCRIPT, "sh", str(top), str(paths), how, *map(str, words)]


@cache
def _paths() -> list[str]:
    """Return the paths under /usr that belong only to packages of ROS."""
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
    """Return the paths that the packages installed."""
    if not packages:
        return []
    words = ["dpkg", "--listfiles", *packages]
    return subprocess.run(words, capture_output=True, text=True, check=True).stdout.splitlines()
