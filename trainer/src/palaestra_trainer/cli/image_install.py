"""`palaestra-install` installs a user's project while an image is built FROM one of Palaestra's images.

The project goes to the first folder of PYTHONPATH, together with the dependencies that the image lacks. The
packages of the image stay as they were tested, because the project can neither replace nor hide them. If the
image has all dependencies, the build works without a package index: the image also contains the build
backends hatchling and setuptools.
"""

from __future__ import annotations

import argparse
import compileall
import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from importlib.metadata import Distribution, PathDistribution, distributions
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from palaestra_trainer.errors import ConfigurationError

DESCRIPTION = """\
Install a project of your own, while an image is built FROM one of Palaestra's.

FOLDER holds a pyproject.toml or setup.py, or is a bare folder of modules and packages.
It may be read-only. Hidden files, __pycache__ and a folder `runs` at its top are left out.
Dependencies that the image lacks are installed too; the package index must then be reachable.
"""
PROJECT_FILES = ("pyproject.toml", "setup.py")
RUNS = "runs"  # `palaestra run` writes this folder into the folder of the job
DEFAULT_BACKEND = ("setuptools",)  # Source: PEP 518, for a project without [build-system]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run `palaestra-install`; return 0, or 2 if the folder cannot be installed."""
    parser = argparse.ArgumentParser(
        prog="palaestra-install",
        description=DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("folder", type=Path, metavar="FOLDER")
    folder: Path = parser.parse_args(arguments).folder
    try:
        install(folder, _target())
    except (ConfigurationError, OSError) as error:
        sys.stderr.write(f"palaestra-install: {error}\n")
        return 2
    return 0


def install(folder: Path, target: Path) -> None:
    """Install the project in `folder` into `target`; after an error, `target` is unchanged.

    Raises:
        ConfigurationError: the project cannot be built, or it would replace or hide a package of the image.
    """
    with tempfile.TemporaryDirectory() as scratch:
        source, staged = Path(scratch, "source"), Path(scratch, "staged")
        _copy(folder, source)
        if any((source / name).is_file() for name in PROJECT_FILES):
            _install_project(source, staged)
        else:
            shutil.copytree(source, staged)
        _check_names(folder, staged, target)
        _check_requirements(staged)
        # The byte code is compiled while the image is built, because the root file system of a pod is
        # read-only.
        compileall.compile_dir(staged, quiet=1, stripdir=str(staged), prependdir=str(target))
        _replace(staged, target)


def _replace(staged: Path, target: Path) -> None:
    """Remove older versions of the staged distributions from `target`, then copy the staged files there."""
    new = {canonicalize_name(PathDistribution(path).name) for path in staged.glob("*.dist-info")}
    for path in target.glob("*.dist-info"):
        old = PathDistribution(path)
        if canonicalize_name(old.name) in new:
            for file in old.files or ():
                Path(str(old.locate_file(file))).unlink(missing_ok=True)
            shutil.rmtree(path)
    shutil.copytree(staged, target, dirs_exist_ok=True, ignore=shutil.ignore_patterns(".lock"))


def _target() -> Path:
    first, *_ = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    if not first:
        raise ConfigurationError(
            "PYTHONPATH: does not begin with a folder, so the folder in which to install the project is not "
            "known; run this in a Dockerfile FROM palaestra-trainer"
        )
    return Path(first)


def _copy(folder: Path, source: Path) -> None:
    """Copy a project to a folder in which a build backend can write files."""
    if not folder.is_dir():
        raise ConfigurationError(f"{folder}: is not a folder; name the folder with your project")

    def left_out(at: str, names: Iterable[str]) -> set[str]:
        top = {RUNS} if Path(at) == folder else set()
        return {name for name in names if name.startswith(".") or name in {"__pycache__", *top}}

    try:
        shutil.copytree(folder, source, ignore=left_out)
    except (PermissionError, shutil.Error) as error:
        raise ConfigurationError(
            f"{folder}: user {os.getuid()} cannot copy all of it; `chmod --recursive a+rX` it on your "
            "machine, and remove links to missing files"
        ) from error


def _install_project(source: Path, staged: Path) -> None:
    """Build the project and install it into `staged`, with the dependencies that the image lacks.

    uv skips the packages of the image, even if the project requires another version of such a package.
    `_check_requirements` finds such a conflict later.
    """
    project = _pyproject(source)
    there = list(distributions())
    own = canonicalize_name(project.get("project", {}).get("name", ""))
    listed = source.with_name("image.txt")
    listed.write_text(
        "".join(f"{name}\n" for name in {canonicalize_name(each.name) for each in there} - {own})
    )
    backend = project.get("build-system", {}).get("requires", DEFAULT_BACKEND)
    here = not any(_unmet(map(Requirement, backend), there))
    command = ["uv", "pip", "install", "--quiet", "--no-cache", f"--python={sys.executable}"]
    options = [f"--target={staged}", f"--excludes={listed}", *(["--no-build-isolation"] if here else [])]
    if subprocess.run([*command, *options, str(source)], check=False).returncode:
        raise ConfigurationError("uv could not install the project; its message is above")


def _pyproject(source: Path) -> Mapping[str, Any]:
    file = source / "pyproject.toml"
    try:
        return tomllib.loads(file.read_text()) if file.is_file() else {}
    except tomllib.TOMLDecodeError as error:
        raise ConfigurationError(f"pyproject.toml: {error}; correct the line") from error


def _check_names(folder: Path, staged: Path, target: Path) -> None:
    """Refuse a project without a module, and a project that would hide a module of the image."""
    names = sorted(_importable(staged))
    if not names or "__init__" in names:
        fact = "is itself a package" if names else "holds neither a module nor a package"
        raise ConfigurationError(f"{folder}: {fact}; name the folder that holds your modules")
    for name in names:
        if name in sys.stdlib_module_names or _elsewhere(name, target):
            raise ConfigurationError(
                f"{name}: the project would hide the image's module of this name; rename it"
            )


def _importable(folder: Path) -> Iterator[str]:
    """Yield the names by which the modules and packages directly in a folder are imported."""
    for path in folder.iterdir():
        if path.suffix in {".py", ".so"} or (path / "__init__.py").is_file():
            yield path.name.partition(".")[0]


def _elsewhere(name: str, target: Path) -> bool:
    """Return whether a module is imported from another folder than `target`."""
    found = find_spec(name)
    return bool(found and found.origin and not Path(found.origin).is_relative_to(target))


def _check_requirements(staged: Path) -> None:
    """Refuse a project that needs a version or an extra of a package that the image does not have."""
    new = [PathDistribution(path) for path in staged.glob("*.dist-info")]
    there = [*new, *distributions()]
    for distribution in new:
        for requirement in _unmet(_requirements(distribution), there):
            name, found = distribution.name, _found(requirement, there)
            wanted = f"{name}: needs {requirement.name}{requirement.specifier}"
            if found is None:
                raise ConfigurationError(
                    f"{wanted}, which the image does not have; add {requirement.name} to your dependencies"
                )
            raise ConfigurationError(
                f"{wanted}, and the image has {found.version}; use a version of {name} that accepts "
                f"{found.version}, or relax the requirement if it is your own"
            )


def _unmet(requirements: Iterable[Requirement], there: Sequence[Distribution]) -> Iterator[Requirement]:
    """Yield the requirements that no distribution meets, including the requirements of requested extras."""
    for requirement in requirements:
        found = _found(requirement, there)
        if found is None or not requirement.specifier.contains(found.version, prereleases=True):
            yield requirement
        else:
            for extra in requirement.extras:
                yield from _unmet(_requirements(found, extra), there)


def _requirements(distribution: Distribution, extra: str = "") -> Iterator[Requirement]:
    """Yield the requirements of a distribution, or only those of an extra, on this platform."""
    for requirement in map(Requirement, distribution.requires or ()):
        marker = requirement.marker
        always = marker is None or marker.evaluate({"extra": ""})
        if always != bool(extra) and (marker is None or marker.evaluate({"extra": extra})):
            yield requirement


def _found(requirement: Requirement, there: Iterable[Distribution]) -> Distribution | None:
    wanted = canonicalize_name(requirement.name)
    return next((each for each in there if canonicalize_name(each.name) == wanted), None)
