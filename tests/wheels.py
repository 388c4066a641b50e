"""Wheels of the three packages, and environments in which a Python of this machine has them installed.

Tests use no network, because dependencies come from uv's cache. `python -m tests.wheels` fills the cache and
downloads 1 GB for each Python, mostly PyTorch.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
VERSIONS = ("3.11", "3.12", "3.13")  # the versions that the trainer's requires-python names
COMMAND = "python -m tests.wheels"
DEADLINE_S = 240
_UV = Path(sys.executable).with_name("uv")
_PACKAGES = ("operator", "sim_image", "trainer")
# pyenv and uv install Pythons in these folders. A Python on the PATH may be a shim for another version.
_HOMES = (".pyenv/versions", ".local/share/uv/python")


class Uncached(Exception):
    """A package that the installation needs is not in uv's cache."""


def built(folder: Path) -> list[Path]:
    """Build the wheels of all three packages into a folder, and return them."""
    for package in _PACKAGES:
        words = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(folder)]
        subprocess.run(words, cwd=ROOT / package, check=True, capture_output=True, timeout=DEADLINE_S)
    return sorted(folder.glob("*.whl"))


def python(version: str) -> Path | None:
    """Return an interpreter of a version such as `3.12`, or None if this machine has none."""
    return next((path for path in _candidates(version) if _is(path, version)), None)


def install(wheels: list[Path], interpreter: Path, folder: Path, *, offline: bool = True) -> Path:
    """Make an environment with the wheels in a folder, and return the folder of its programs.

    Raises:
        Uncached: `offline` is true, and a package must be downloaded.
    """
    wanted = [_with_training(wheel) for wheel in wheels]
    quiet = [_UV, "--quiet", *(["--offline"] if offline else [])]
    environment = ["--python", folder]
    subprocess.run(
        [*quiet, "venv", "--no-project", "--python", interpreter, folder], check=True, timeout=DEADLINE_S
    )
    done = subprocess.run(
        # Symbolic links need no disk space, and they work across file systems.
        [*quiet, "pip", "install", "--link-mode", "symlink", *environment, *wanted],
        capture_output=True,
        text=True,
        timeout=None if not offline else DEADLINE_S,
        check=False,
    )
    if offline and done.returncode and ("network" in done.stderr or "cache" in done.stderr):
        raise Uncached(f"packages for {interpreter.name} are not in uv's cache; `{COMMAND}` downloads them")
    if done.returncode:
        raise RuntimeError(done.stderr)
    subprocess.run([*quiet, "pip", "check", *environment], check=True, timeout=DEADLINE_S)
    return folder / "bin"


def _with_training(wheel: Path) -> str:
    """Return the requirement of a wheel, with the libraries for training if it is that of the trainer."""
    if wheel.name.startswith("palaestra_trainer"):
        return f"palaestra-trainer[train] @ {wheel.as_uri()}"
    return str(wheel)


def cache() -> Path:
    """Return the folder of uv's cache, to which the environments link."""
    shown = subprocess.run([_UV, "cache", "dir"], capture_output=True, text=True, timeout=60, check=True)
    return Path(shown.stdout.strip())


def _candidates(version: str) -> Iterator[Path]:
    name = f"python{version}"
    yield Path("/usr/bin") / name
    yield Path("/usr/local/bin") / name
    for home in _HOMES:
        yield from sorted((Path.home() / home).glob(f"*/bin/{name}"))


def _is(path: Path, version: str) -> bool:
    if not path.exists():
        return False
    words = [path, "-c", "import sys; print('%d.%d' % sys.version_info[:2])"]
    return (
        subprocess.run(words, capture_output=True, text=True, timeout=60, check=False).stdout.strip()
        == version
    )


def main() -> int:
    """Install the wheels into every Python of this machine, with downloads."""
    with tempfile.TemporaryDirectory() as folder:
        wheels = built(Path(folder))
        for version in VERSIONS:
            if interpreter := python(version):
                sys.stderr.write(f"{interpreter}\n")
                install(wheels, interpreter, Path(folder, version), offline=False)
    return 0


if __name__ == "__main__":
    sys.exit(main())
