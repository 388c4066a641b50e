"""The folder that an image is built from, with exactly the files that the image needs.

Wheels are fetched and built outside of the image's build, because pip on this machine has the index, its
proxy and its certificates; the build itself uses no index. The cache keeps the wheels until the lock changes.
"""

import os
import shutil
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from tools.images import cache, lock, programs
from tools.images.errors import ImagesError
from tools.images.recipes import Recipe, digest, digest_of_files, left_out, project, sources

_FETCH_OPTIONS = (
    *("--disable-pip-version-check", "--progress-bar=off"),
    *("--no-deps", "--require-hashes", "--only-binary=:all:"),
    *(f"--python-version={lock.PYTHON}", "--implementation=cp", f"--abi=cp{lock.PYTHON.replace('.', '')}"),
)
_FETCH_DEADLINE_S = 1800  # PyTorch with CUDA is 3 GB
_MAKE_DEADLINE_S = 120
_OLDEST_GLIBC, _NEWEST_GLIBC = 5, 41  # 2.41 is Debian trixie's


@dataclass(frozen=True, slots=True, kw_only=True)
class Locked:
    """Packages from the index, as a requirements file with hashes, and the digest of that file."""

    text: str
    digest: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Contents:
    """The content of one image: its part of the lock, its additional lock, and a digest of our packages."""

    requirements: Locked
    extra: Locked | None
    packages_digest: str


def contents(root: Path, recipe: Recipe, machine: str) -> Contents:
    """Return the content of an image for a `machine` (x86_64).

    Raises:
        ImagesError: the lock does not have the format that `make lock` writes.
    """
    projects = [project(root, package) for package in recipe.packages]
    pins = _pins(root / "requirements.lock")
    for one in projects:
        pins = lock.unwanted(pins, one["name"], left_out(one, recipe.extras))
    share = lock.share(pins, [one["name"] for one in projects], machine, recipe.without)
    ours = [path for package in recipe.packages for path in sources(root, package)]
    files = [root / file for file in recipe.files]
    return Contents(
        requirements=_locked(share, machine),
        extra=_extra(root / recipe.extra, share, machine) if recipe.extra else None,
        packages_digest=digest_of_files(root, (*ours, *files)),
    )


def fill(folder: Path, root: Path, recipe: Recipe, inside: Contents, *, wheels: Path, machine: str) -> None:
    """Make `folder` the context of an image; wheels from the index are cached in the folder `wheels`.

    Raises:
        ImagesError: a wheel cannot be fetched or made.
    """
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name, locked in (("requirements", inside.requirements), ("extra", inside.extra)):
        if locked is not None:
            (folder / f"{name}.txt").write_text(locked.text)
            fetched = _fetched(wheels / locked.digest, locked, machine)
            shutil.copytree(fetched, folder / "wheels", copy_function=os.link, dirs_exist_ok=True)
    shutil.copy(_uv(), folder / "uv")
    for file in recipe.files:
        shutil.copy(root / file, folder)
    for name, path in recipe.given.items():
        shutil.copy(path, folder / name)
    for package in recipe.packages:
        _make_wheel(root / package, folder / "packages")


def _pins(file: Path) -> Sequence[lock.Pin]:
    try:
        return lock.parse(file.read_text())
    except ValueError as error:
        raise ImagesError(f"{file.name}: {error}") from error


def _extra(file: Path, share: str, machine: str) -> Locked:
    """Return an additional lock without the packages of `share`, the image's part of the main lock."""
    pins = _pins(file)
    there = [pin.name for pin in lock.parse(share)]
    return _locked(lock.share(pins, [pin.name for pin in pins], machine, there), machine)


def _locked(requirements: str, machine: str) -> Locked:
    return Locked(text=requirements, digest=digest((requirements, machine)))


def _fetched(kept: Path, locked: Locked, machine: str) -> Path:
    """Return the folder of the locked wheels; if one wheel cannot be fetched, the folder is not created."""
    if kept.exists():
        cache.use(kept)
        return kept
    part = kept.with_name(f"{kept.name}.part")
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir(parents=True)
    listed, log = part / "requirements.txt", part / "pip.log"
    listed.write_text(locked.text)
    fetch = [sys.executable, "-m", "pip", "download", *_FETCH_OPTIONS, f"--dest={part}"]
    platforms = (f"--platform={platform}" for platform in _platforms(machine))
    programs.run([*fetch, *platforms, f"--requirement={listed}"], log=log, deadline_s=_FETCH_DEADLINE_S)
    listed.unlink()
    log.unlink()
    part.rename(kept)
    return kept


def _platforms(machine: str) -> Iterator[str]:
    """Yield the tags of wheels that run on trixie, the best first."""
    for minor in range(_NEWEST_GLIBC, _OLDEST_GLIBC - 1, -1):
        yield f"manylinux_2_{minor}_{machine}"
    yield from (f"manylinux2014_{machine}", f"manylinux1_{machine}", f"linux_{machine}")


def _make_wheel(package: Path, target: Path) -> None:
    programs.run(
        [
            *(_uv(), "build", "--quiet", "--wheel", "--no-build-isolation", "--offline"),
            *("--python", sys.executable, "--out-dir", str(target), str(package)),
        ],
        log=target.with_suffix(".log"),
        deadline_s=_MAKE_DEADLINE_S,
    )


def _uv() -> str:
    """Return the path of uv, in the version that the lock names."""
    beside = Path(sys.executable).with_name("uv")
    if not beside.exists():
        raise ImagesError(f"{beside}: is missing; run `make setup`")
    return str(beside)
