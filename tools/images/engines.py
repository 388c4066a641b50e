"""The engine that builds an image: Docker if its engine responds and has the base image, otherwise buildah.

Both build the same Dockerfiles and write a docker archive, which `kind load image-archive` accepts.
"""

import hashlib
import os
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, Self

from tools.images import programs
from tools.images.errors import ImagesError

DEBIAN = "docker.io/library/debian:trixie-slim"
# With these options, the mounts and the processes of a build end with the build, even if it is killed.
_ISOLATED = ("unshare", "--mount", "--pid", "--fork", "--kill-child", "--mount-proc", "--")
_ASK_DEADLINE_S = 20
_PULL_DEADLINE_S = 180
_STEP_DEADLINE_S = 600
_BUILD_DEADLINE_S = 3600


@dataclass(frozen=True, slots=True, kw_only=True)
class Base:
    """The base image: its name, and a digest of its content."""

    name: str
    digest: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Order:
    """One image to be built: its full name, its context, and the archive to be written."""

    reference: str
    dockerfile: Path
    context: Path
    arguments: Mapping[str, str]
    archive: Path
    log: Path


class Engine(Protocol):
    """Builds images."""

    def base(self) -> Base:
        """Return the base image.

        Raises:
            ImagesError: no engine is available.
        """
        ...

    def build(self, order: Order) -> None:
        """Build an image and write its archive; if a step fails, no archive is left.

        Raises:
            ImagesError: a step failed.
        """
        ...

    def load(self, archive: Path, log: Path) -> None:
        """Load the image of an archive under its name, so that another image can be built FROM it.

        Raises:
            ImagesError: the archive cannot be read.
        """
        ...


class Docker:
    """Docker Engine, with its own cache of layers."""

    def __init__(self, base: Base) -> None:
        self._base = base

    @classmethod
    def here(cls, image: str = DEBIAN) -> Self | None:
        """Return Docker if its engine responds, can build, and has or can pull the base image; else None."""
        for question in (["docker", "version"], ["docker", "buildx", "version"]):
            if programs.answer(question, deadline_s=_ASK_DEADLINE_S) is None:
                return None
        inspect = ["docker", "image", "inspect", "--format={{.Id}}", image]
        found = programs.answer(inspect, deadline_s=_ASK_DEADLINE_S)
        if found is None:
            programs.answer(["docker", "pull", "--quiet", image], deadline_s=_PULL_DEADLINE_S)
            found = programs.answer(inspect, deadline_s=_ASK_DEADLINE_S)
        return cls(Base(name=image, digest=found)) if found is not None else None

    def base(self) -> Base:
        """Return Debian's own image."""
        return self._base

    def build(self, order: Order) -> None:
        """Build by `docker buildx build`, and write the archive by `docker save`."""
        build = ["docker", "buildx", "build", "--load", "--progress=plain"]
        programs.run([*build, *_what(order)], log=order.log, deadline_s=_BUILD_DEADLINE_S)
        part = order.archive.with_suffix(".part")
        save = ["docker", "save", f"--output={part}", order.reference]
        programs.run(save, log=_beside(order.log, "archive"), deadline_s=_STEP_DEADLINE_S)
        part.rename(order.archive)

    def load(self, archive: Path, log: Path) -> None:
        """Load an archive by `docker load`."""
        programs.run(["docker", "load", f"--input={archive}"], log=log, deadline_s=_STEP_DEADLINE_S)


class Buildah:
    """buildah with its own store in the cache; its base image is a tree made by debootstrap.

    Steps run in a chroot, because builds inside a container need a chroot. Steps use this machine's network.
    """

    def __init__(self, folder: Path, tree: Path) -> None:
        self._tree = tree
        self._logs = folder / "logs"
        self._base = Base(name=f"localhost/{tree.stem}", digest=tree.stem)
        # The folder must be in /run: a restart of the machine removes the mounts, and clears /run too.
        mounted = Path("/run") / f"palaestra-{hashlib.sha256(os.fsencode(folder)).hexdigest()[:12]}"
        self._store = (f"--root={folder / 'store'}", f"--runroot={mounted}", "--storage-driver=overlay")

    @classmethod
    def here(cls, folder: Path, root: Path) -> Self:
        """Return buildah with the tree that tests/cluster/base.sh makes; install buildah if it is missing.

        The caller must hold the lock of `folder`, because this method removes containers of killed builds.

        Raises:
            ImagesError: the user is not root, or a part cannot be installed.
        """
        if os.geteuid() != 0:
            raise ImagesError(
                "no Docker Engine with buildx and debian:trixie-slim responds, and without Docker only root "
                "can build images; start Docker, or repeat this command with sudo"
            )
        logs = folder / "logs"
        if shutil.which("buildah") is None:
            install = str(root / "tests" / "cluster" / "packages.sh")
            programs.run([install, "buildah"], log=logs / "apt.log", deadline_s=_STEP_DEADLINE_S)
        tree = programs.answer([str(root / "tests" / "cluster" / "base.sh")], deadline_s=_STEP_DEADLINE_S)
        if tree is None:
            raise ImagesError("tests/cluster/base.sh: made no Debian tree; run it to see why")
        found = cls(folder, Path(tree))
        found._answer("rm", "--all")
        if found._answer("inspect", "--type=image", found._base.name) is None:
            found._import_tree()
        return found

    def base(self) -> Base:
        """Return the tree's image; the name of the tree's file has a digest of its sources."""
        return self._base

    def build(self, order: Order) -> None:
        """Build by `buildah build`, and write the archive by `buildah push`."""
        build = ("build", "--layers", "--pull-never", "--isolation=chroot")
        self._run([*build, *_what(order)], log=order.log, deadline_s=_BUILD_DEADLINE_S)
        part = order.archive.with_suffix(".part")
        part.unlink(missing_ok=True)  # buildah would append to an existing file
        push = ("push", "--quiet", order.reference, f"docker-archive:{part}:{order.reference}")
        self._run(push, log=_beside(order.log, "archive"), deadline_s=_STEP_DEADLINE_S)
        part.rename(order.archive)
        self._answer("rmi", "--prune")

    def load(self, archive: Path, log: Path) -> None:
        """Load an archive by `buildah pull`; layers that are in the store are not written again."""
        self._run(["pull", "--quiet", f"docker-archive:{archive}"], log=log, deadline_s=_STEP_DEADLINE_S)

    def _import_tree(self) -> None:
        dockerfile = self._logs / "Dockerfile.base"
        dockerfile.parent.mkdir(parents=True, exist_ok=True)
        dockerfile.write_text(f'FROM scratch\nADD {self._tree.name} /\nCMD ["bash"]\n')
        build = ("build", "--isolation=chroot", f"--tag={self._base.name}", f"--file={dockerfile}")
        self._run([*build, str(self._tree.parent)], log=self._logs / "base.log", deadline_s=_STEP_DEADLINE_S)

    def _run(self, arguments: Sequence[str], *, log: Path, deadline_s: float) -> None:
        programs.run([*_ISOLATED, "buildah", *self._store, *arguments], log=log, deadline_s=deadline_s)

    def _answer(self, *arguments: str) -> str | None:
        return programs.answer([*_ISOLATED, "buildah", *self._store, *arguments], deadline_s=_STEP_DEADLINE_S)


def _what(order: Order) -> list[str]:
    """Return the arguments that describe the build; docker and buildah take the same arguments."""
    return [
        f"--tag={order.reference}",
        f"--file={order.dockerfile}",
        *(f"--build-arg={name}={value}" for name, value in order.arguments.items()),
        str(order.context),
    ]


def _beside(log: Path, what: str) -> Path:
    return log.with_name(f"{log.stem}-{what}.log")
