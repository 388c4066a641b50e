"""The images and their parts."""

import hashlib
import tomllib
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

NOTEBOOKS = (
    "1-drive.ipynb",
    "2-environment.ipynb",
    "3-train-and-watch.ipynb",
    "4-evaluate.ipynb",
    "5-cluster.ipynb",
    "6-train.ipynb",
    "6-train.yaml",
)
REGISTRY = "docker.io/library"  # the prefix that a cluster adds to a name without a host


@dataclass(frozen=True, slots=True, kw_only=True)
class Recipe:
    """One image.

    `packages` are the folders of our packages in the image, and `extras` names the optional dependencies of
    these packages. `files` are other files that the Dockerfile runs or copies. `without` names locked
    packages that the image leaves out. `extra` is an additional lock, whose packages the image has too.
    `arguments` are the arguments of the Dockerfile. `given` has files of the person who builds the image, by
    their names in the build context; an argument of the Dockerfile must have the digest of each file.
    """

    name: str
    dockerfile: str
    packages: tuple[str, ...]
    extras: tuple[str, ...] = ()
    files: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    extra: str | None = None
    arguments: Mapping[str, str] = field(default_factory=dict)
    given: Mapping[str, Path] = field(default_factory=dict)

    def reference(self, tag: str) -> str:
        """Return the image's full name."""
        return f"{REGISTRY}/palaestra-{self.name}:{tag}"


def recipes(torch: str) -> Mapping[str, Recipe]:
    """Return all images by name; `torch` is `debian` or `cuda`, the PyTorch of trainer and notebook."""
    stood_in_for = ("torch",) if torch == "debian" else ()  # the distribution's PyTorch replaces it
    return {
        "stub": Recipe(
            name="stub",
            dockerfile="sim_image/Dockerfile.stub",
            packages=("sim_image",),
            files=("sim_image/standalone.sh",),
            extras=("pictures",),
        ),
        "mujoco": Recipe(
            name="mujoco",
            dockerfile="sim_image/Dockerfile.mujoco",
            packages=("sim_image",),
            extras=("mujoco",),
        ),
        "trainer": Recipe(
            name="trainer",
            dockerfile="trainer/Dockerfile",
            packages=("sim_image", "trainer"),
            extras=("install", "train"),
            without=stood_in_for,
            arguments={"TORCH": torch},
        ),
        "notebook": Recipe(
            name="notebook",
            dockerfile="images/notebook/Dockerfile",
            packages=("sim_image", "trainer", "operator"),
            extras=("install", "train"),
            files=(
                "images/notebook/notebook.sh",
                "images/notebook/overrides.json",
                *(f"examples/notebooks/{name}" for name in NOTEBOOKS),
            ),
            without=(
                *stood_in_for,
                "kubernetes",
            ),  # kubernetes is in the notebook's lock instead, so that trainer and notebook share layers
            extra="images/notebook/requirements.lock",
            arguments={"TORCH": torch},
        ),
        "operator": Recipe(
            name="operator",
            dockerfile="operator/Dockerfile",
            packages=("sim_image", "operator"),
            # Only the asynchronous half of the client for Kubernetes needs these packages, and the image
            # leaves that half out.
            without=("aiohttp", "aiohttp-retry"),
        ),
    }


def project(root: Path, package: str) -> Mapping[str, Any]:
    """Return name, version and dependencies of one of our packages, as its pyproject.toml has them."""
    found: Mapping[str, Any] = tomllib.loads((root / package / "pyproject.toml").read_text())["project"]
    return found


def left_out(project: Mapping[str, Any], extras: Collection[str]) -> frozenset[str]:
    """Return the names of packages that a project needs only for other extras than `extras`."""
    optional: Mapping[str, Sequence[str]] = project.get("optional-dependencies", {})
    wanted = [*project["dependencies"], *(each for extra in extras for each in optional.get(extra, ()))]
    return _names(each for listed in optional.values() for each in listed) - _names(wanted)


def _names(requirements: Iterable[str]) -> frozenset[str]:
    return frozenset(canonicalize_name(Requirement(each).name) for each in requirements)


def sources(root: Path, package: str) -> Iterator[Path]:
    """Yield the files that a package's wheel is made of, in a fixed order."""
    yield root / package / "pyproject.toml"
    for path in sorted((root / package / "src").rglob("*")):
        if path.is_file() and "__pycache__" not in path.parts:
            yield path


def digest(parts: Iterable[bytes | str]) -> str:
    """Return 12 hexadecimal digits of a digest of the parts, which depends on their order and borders."""
    total = hashlib.sha256()
    for part in parts:
        data = part.encode() if isinstance(part, str) else part
        total.update(b"%d:" % len(data))
        total.update(data)
    return total.hexdigest()[:12]


def digest_of_files(root: Path, paths: Iterable[Path]) -> str:
    """Return the digest of files below `root`: of their names, contents and whether they can be run."""
    return digest(
        part
        for path in paths
        for part in (str(path.relative_to(root)), str(path.stat().st_mode & 0o100), path.read_bytes())
    )
