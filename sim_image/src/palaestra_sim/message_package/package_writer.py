"""Write the package webots_ros into a folder, atomically; never replace a package that we did not write."""

from __future__ import annotations

import compileall
import tempfile
from pathlib import Path

from palaestra_protocol.whole_file import write_whole
from palaestra_sim.errors import ForeignPackageError
from palaestra_sim.message_package.files import MANIFEST, NAME, package_files


def write(folder: Path) -> Path:
    """Write the package into `folder` and return its path; a package of an earlier release is replaced.

    If the process is killed, the folder has the complete old package, the complete new one, or no package.

    Raises:
        ForeignPackageError: the folder has a webots_ros that Palaestra did not write.
    """
    target = folder / NAME
    _check_ours(target)
    folder.mkdir(parents=True, exist_ok=True)
    # The temporary folder is hidden because rospkg skips hidden folders.
    with tempfile.TemporaryDirectory(prefix=f".{NAME}-", dir=folder) as temporary:
        made = Path(temporary) / NAME
        _fill(made)
        compileall.compile_dir(made, quiet=1, stripdir=str(made), prependdir=str(target))
        if target.exists():
            target.rename(Path(temporary) / "replaced")
        made.rename(target)
    return target


def make_importable(package: Path, packages_of_python: Path) -> None:
    """Make the package importable for the Python whose packages are in `packages_of_python`.

    If that folder has another webots_ros, Python imports the other one.
    """
    lines = packages_of_python / f"{NAME}.pth"
    write_whole(lines, f"{package.resolve() / 'src'}\n".encode())


def _check_ours(target: Path) -> None:
    if not target.exists():
        return
    manifest = target / MANIFEST
    if not manifest.exists() or "<author>Palaestra</author>" not in manifest.read_text(errors="replace"):
        raise ForeignPackageError(
            f"{target}: is a package that Palaestra did not write; "
            "use it as it is, remove it, or choose another folder"
        )


def _fill(package: Path) -> None:
    for name, text in package_files():
        path = package / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
