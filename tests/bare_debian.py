"""Run commands as an ordinary user in a bare Debian 13, in which some folders of this machine are mounted.

The root file system is the base of the images, which `tests/cluster/base.sh` makes. It contains no Python, no
compiler and no package of ROS. It is mounted in a mount namespace that ends with the command.
"""

from __future__ import annotations

import os
import subprocess
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path

CACHE = Path(os.environ.get("PALAESTRA_CACHE") or Path.home() / ".cache/palaestra")
BASE = "tests/cluster/base.sh"
_SCRIPT = """\
set -e
top=$1; tree=$2; libraries=$3; folders=$4; work=$5; shift 5
mount -t tmpfs -o mode=755 bare "$top"
tar -xf "$tree" -C "$top"
while read -r folder; do
  mkdir -p "$top$folder"
  mount --bind "$folder" "$top$folder"
done <"$folders"
xargs --arg-file="$libraries" cp --target-directory="$top/usr/lib"
chmod 711 "$top/root"
chmod 1777 "$top/tmp"
mount -t proc proc "$top/proc"
mount --rbind /dev "$top/dev"
mkdir --mode=777 "$top/work"
mount --bind "$work" "$top/work"
exec chroot --userspec=65534:65534 "$top" /usr/bin/env --chdir=/work HOME=/work PATH=/usr/bin:/bin "$@"
"""


def lack() -> str | None:
    """Return the reason why no bare Debian can be mounted here, or None."""
    if _tree() is None:
        return f"the tree of Debian is not made; `{BASE}` makes it"
    with tempfile.TemporaryDirectory() as folder:
        mount = ("unshare", "--mount", "mount", "-t", "tmpfs", "none", folder)
        if os.geteuid() or subprocess.run(mount, capture_output=True, timeout=60, check=False).returncode:
            return "only root may mount a tree of Debian"
    return None


def command(words: Sequence[str | Path], work: Path, folders: Iterable[Path], interpreter: Path) -> list[str]:
    """Return a command that runs `words` in the bare Debian, in its folder `/work`.

    Args:
        words: the program and its arguments.
        work: the folder of this machine that is mounted as `/work`.
        folders: folders of this machine that are mounted at the same paths.
        interpreter: a Python in one of `folders`; the system libraries that it needs are copied.
    """
    top = work.parent / "bare"
    top.mkdir()
    work.chmod(0o777)
    libraries, listed = work.parent / "libraries.txt", work.parent / "folders.txt"
    libraries.write_text("".join(f"{path}\n" for path in _libraries(interpreter)))
    listed.write_text("".join(f"{folder}\n" for folder in folders))
    given = (top, _tree(), libraries, listed, work, *words)
    return ["unshare", "--mount", "sh", "-c", _SCRIPT, "sh", *map(str, given)]


def _tree() -> Path | None:
    return max((CACHE / "base").glob("trixie-*.tar"), key=lambda path: path.stat().st_mtime, default=None)


def _libraries(interpreter: Path) -> list[str]:
    """Return the system libraries, except those of glibc, that a Python's extension modules need."""
    own = interpreter.resolve().parents[1]
    modules = own.glob("lib/python3.*/lib-dynload/*.so")
    shown = subprocess.run(["ldd", *modules], capture_output=True, text=True, timeout=60, check=True).stdout
    found = {line.split()[2] for line in shown.splitlines() if " => /" in line}
    wanted = ("libexpat", "libffi", "libreadline", "libsqlite3")
    return sorted(path for path in found if Path(path).name.startswith(wanted))
